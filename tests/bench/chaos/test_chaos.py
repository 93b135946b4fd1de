"""The trials with faults can be named one by one, and each says on which stores it is tried."""

import subprocess
import sys

from bench.chaos.__main__ import BIG, LITE, TRIALS


def test_trials_have_names_of_their_own_and_stores_that_exist() -> None:
    assert len({trial.name for trial in TRIALS}) == len(TRIALS)
    assert all(trial.stores and set(trial.stores) <= {LITE, BIG, "none"} for trial in TRIALS)


def test_they_are_listed_without_being_carried_out() -> None:
    run = subprocess.run([sys.executable, "-m", "bench.chaos", "--list"], capture_output=True, text=True, check=True)
    assert [line.partition(":")[0] for line in run.stdout.splitlines()] == [trial.name for trial in TRIALS]
