"""``python -m bench.random_arms [kind ...] [--seeds 0:100]``: random tasks of one arm, answered and judged.

Every answer is held against the proof of branch and bound where that closes, else against a long search of its own
(`bench.random_arms.long_search`). What was judged is kept in build/bench/random_arms.jsonl, and what is there is not
run again: the command continues where it stopped. ``--again`` drops the answers of the tasks that are asked for, not
what is known of them.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from bench.random_arms.draw import KINDS
from bench.random_arms.judge import Known, Trial, judged
from bench.random_arms.table import table
from bench.trials.trial import append, read

OUTPUT = Path("build/bench/random_arms.jsonl")


def main() -> int:
    """Run what is asked for and has not been run."""
    parser = argparse.ArgumentParser(prog="python -m bench.random_arms", description=__doc__)
    parser.add_argument("kinds", nargs="*", choices=[*KINDS, []], help="default: all of them")
    parser.add_argument("--seeds", default="0:20", metavar="FIRST:END", help="of every kind")
    parser.add_argument("--again", action="store_true", help="answer again; what is known of the tasks is kept")
    parser.add_argument("--output", type=Path, default=OUTPUT, metavar="FILE")
    options = parser.parse_args()
    first, end = (int(number) for number in options.seeds.split(":"))
    asked = [(kind, seed) for seed in range(first, end) for kind in options.kinds or KINDS]
    trials = _read(options.output)
    known = {key: trial.known for key, trial in trials.items()}
    if options.again:
        trials = {key: trial for key, trial in trials.items() if key not in set(asked)}
    for kind, seed in asked:
        if (kind, seed) not in trials:
            trial = judged(kind, seed, known.get((kind, seed), Known()))
            trials[kind, seed] = trial
            append(options.output, trial.record)
            if trial.missed or trial.refused:
                print(trial.record, flush=True)
    print(table([trials[key] for key in asked]))
    return 0


def _read(path: Path) -> dict[tuple[str, int], Trial]:
    """The trials of a file, the last of every task."""
    trials = [Trial.of(record) for record in read(path)]
    return {(trial.kind, trial.seed): trial for trial in trials}


if __name__ == "__main__":
    raise SystemExit(main())
