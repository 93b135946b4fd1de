"""Search of one arm: outcomes, proofs, basins, limits of time, and no usable base is ever lost."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import Arm
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.nlp.solve import Solve, SolveStatus
from duocell.optimizer.settings import Settings
from duocell.optimizer.single_arm import local as local_module
from duocell.optimizer.single_arm.arm_search import ArmSearch
from duocell.optimizer.single_arm.local import solve_locally
from duocell.optimizer.single_arm.search import search_arm
from duocell.optimizer.verification.arm_path import OVERSHOOT, check_arm_path
from duocell.optimizer.verification.verify import check
from tests.support.given.arms import region
from tests.support.given.tasks import Possible, possible
from tests.support.given.witness import posture_of_witness


def searched(
    task: Possible, arm: Arm | None = None, seconds: float = 60.0, settings: Settings | None = None
) -> ArmSearch:
    return search_arm(task.cell, arm or task.arm, settings or Settings(), time.perf_counter() + seconds)


@pytest.mark.parametrize("name", ["puma560", "ur10e", "iiwa14", "fanuc_crx10ia"])
def test_a_possible_task_is_solved_and_the_answer_is_usable(name: str) -> None:
    task = possible(name, np.random.default_rng(1), half=(0.2, 0.2, 0.0, np.pi))
    found = searched(task)
    assert found.best is not None
    assert found.finished
    assert not found.proved
    assert found.reasons == ()
    assert check(task.cell, task.arm, found.best).usable
    assert found.objective <= float(np.sum(task.arm.weights * (task.joints - task.arm.reference) ** 2)) + 1e-9
    assert found.basins[0][0] == pytest.approx(found.objective)
    assert [value for value, _ in found.basins] == sorted(value for value, _ in found.basins)
    assert 1 <= sum(hits for _, hits in found.basins) <= found.starts
    assert (found.problem is None) == (name in ("iiwa14", "fanuc_crx10ia"))


def test_a_region_out_of_reach_is_proved() -> None:
    task = possible("puma560", np.random.default_rng(2))
    away = replace(task.arm, base=region((20, 21), (20, 21)))
    found = searched(task, away)
    assert found.best is None
    assert found.proved
    assert found.starts == 0
    assert {reason.kind for reason in found.reasons} == {"out_of_reach"}


def test_no_time_means_cut_not_impossible() -> None:
    task = possible("puma560", np.random.default_rng(3))
    found = searched(task, seconds=-1.0)
    assert found.best is None
    assert not found.finished
    assert not found.proved
    assert [reason.kind for reason in found.reasons] == ["limit_reached"]


def test_a_solve_that_time_has_cut_short_is_not_a_finished_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """Even the last one: its point may be usable, but the search has not ended by itself."""
    task = possible("puma560", np.random.default_rng(4))

    def cut(cell: Cell, arm: Arm, start: ArmSolution, deadline: float, known: float) -> Solve:
        result = solve_locally(cell, arm, start, deadline, known)
        while time.perf_counter() < deadline:
            time.sleep(0.01)
        return replace(result, status=SolveStatus.LIMIT, engine_status="Maximum_WallTime_Exceeded")

    monkeypatch.setattr(local_module, "solve_locally", cut)
    fixed = replace(task.arm, base=region(*task.position), posture=posture_of_witness(task))
    found = searched(task, fixed, seconds=1.0)
    assert found.starts == 1
    assert found.best is not None
    assert not found.finished


def test_the_seed_changes_where_the_search_looks_not_what_it_finds() -> None:
    task = possible("ur10e", np.random.default_rng(5))
    one, two = searched(task, settings=Settings(seed=0)), searched(task, settings=Settings(seed=7))
    assert one.objective == pytest.approx(two.objective, rel=1e-5)
    assert searched(task, settings=Settings(seed=7)).objective == two.objective


def test_a_usable_base_that_screening_found_is_not_lost_by_the_local_solver() -> None:
    """Here all local solves end in a point of least infeasibility beside the narrow set that is usable at the poses.

    Between two of them a joint passes its limit by less than a degree on every layout: that one is taken all the same.
    """
    task = possible("hh020", np.random.default_rng(39), step=0.15, half=(0.3, 0.3, 0.0, np.pi))
    cell = replace(task.cell, max_joint_step=0.22015015288375217)
    found = search_arm(cell, task.arm, Settings(), time.perf_counter() + 60.0)
    assert found.optima[0][0] <= 1.001 * 551.58  # by brute force, at the poses alone
    assert found.best is not None
    (one,) = check_arm_path(cell, task.arm, found.best).excesses
    assert (one.joint, one.pose) == ("j3", 3)
    assert 1e-4 < one.amount < OVERSHOOT


def test_screening_of_a_long_task_heeds_the_time_limit_too() -> None:
    """An arm without a reduced problem and 400 poses: what is not looked at in time is not looked at."""
    task = possible("iiwa14", np.random.default_rng(1), poses=400, step=0.002, half=(0.3, 0.3, 0.0, np.pi))
    began = time.perf_counter()
    searched(task, seconds=0.5)
    assert time.perf_counter() - began < 3.0
