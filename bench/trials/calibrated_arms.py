"""Do bounds and refusals hold for arms that are off their drawing, as calibrated arms are?

``python -m bench.trials.calibrated_arms [--count N] [--first SEED] [--seconds S] [--file PATH]``. Every number is an
arm of the catalogue whose joints stand a little beside where they were drawn (1e-6 to 3e-3 rad and m), and a task that
it can do by construction; in every third the limits then leave out what was planted, by as much as the arm is off or
more. A search of the trial's own, on the true kinematics alone, is held against the answer: it must beat no lower
bound, and find nothing where there is said to be nothing.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from bench.trials.trial import Answer, Record, ask, draw_of, is_worse, options_of, run, table
from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, rotation_about, transform
from duocell.models.catalogue import catalogue
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.branches import path_signs
from duocell.models.kinematics.kinematics import characteristic_length, conditioning, flange_poses
from duocell.models.kinematics.nominal import nominal, posture_form
from duocell.models.kinematics.numeric_inverse import brought_to
from duocell.models.robot.arm import FREE_YAW, Arm, BaseRegion, Interval, range_weights
from duocell.models.robot.posture import Posture
from duocell.models.robot.robot import Robot
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.settings import Settings
from duocell.optimizer.verification.arm_path import check_arm_path
from duocell.optimizer.verification.verify import check

ROBOTS = ("ur10e", "puma560", "irb120", "ur3e", "kr6_r900", "nova5")
SMALLEST, LARGEST = 1e-6, 3e-3
"""m and rad, of the errors of each joint."""
STEPS = 0.25
"""rad that a joint moves at most along the task."""
STARTS = 6
DRAWS = 200


@dataclass(frozen=True, eq=False, slots=True)
class Planted:
    """A task, and what is known of it: a usable layout, or None where it was made impossible."""

    cell: Cell
    point: ArmSolution
    size: float
    spoilt: bool

    @property
    def arm(self) -> Arm:
        """The only one."""
        return self.cell.arms[0]


def beside_its_drawing(robot: Robot, size: float, rng: np.random.Generator) -> Robot:
    """The arm with joints turned and shifted by up to ``size`` [rad, m]."""
    placements = robot.joint_placements.copy()
    for i in range(robot.dof):
        axis = rng.normal(size=3)
        turn = rotation_about(axis / np.linalg.norm(axis), size * rng.uniform(0.3, 1.0))
        placements[i] = placements[i] @ transform(turn, size * rng.uniform(-1.0, 1.0, 3))
    return replace(robot, name=f"calibrated {robot.name}", joint_placements=placements, ssik_name=None, flanges=())


def planted(seed: int) -> Planted:
    """One task that an arm can do where it stands, at the world's origin."""
    rng = draw_of("calibrated_arms", seed)
    size = float(np.exp(rng.uniform(np.log(SMALLEST), np.log(LARGEST))))
    robot = beside_its_drawing(catalogue.robot(ROBOTS[seed % len(ROBOTS)]), size, rng)
    for _ in range(DRAWS):
        found = _draw(robot, size, rng)
        usable = check(found.cell, found.arm, found.point).usable
        if usable and check_arm_path(found.cell, found.arm, found.point).free:
            break
    else:
        raise AssertionError("no task was drawn")
    return _spoilt(found, rng) if seed % 3 == 2 else found


def _draw(robot: Robot, size: float, rng: np.random.Generator) -> Planted:
    low, high = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    start, poses = rng.uniform(low + 0.3, high - 0.3), int(rng.integers(2, 8))
    joints = start + np.linspace(-0.5, 0.5, poses)[:, None] * rng.uniform(-STEPS, STEPS, 6)
    lower, upper = robot.lower.copy(), robot.upper.copy()
    tight = rng.random(6) < 0.3
    lower[tight] = np.maximum(lower, np.min(joints, axis=0) - rng.uniform(1e-6, 0.05))[tight]
    upper[tight] = np.minimum(upper, np.max(joints, axis=0) + rng.uniform(1e-6, 0.05))[tight]
    half = rng.choice([0.0, 0.02, 0.3], size=3, p=[0.3, 0.3, 0.4]) * np.array([1.0, 1.0, rng.random() < 0.4])
    sides = [Interval(-h * rng.random(), h * rng.random()) if h else Interval(0.0, 0.0) for h in half]
    yaw = Interval(-0.3, 0.2) if rng.random() < 0.4 else FREE_YAW
    arm = Arm(
        name="arm",
        robot=robot,
        tool=np.eye(4),
        grasp=np.eye(4),
        base=BaseRegion(sides[0], sides[1], sides[2], yaw),
        lower=lower,
        upper=upper,
        reference=np.clip(start + rng.normal(size=6) * rng.choice([0.1, 1.0]), lower, upper),
        weights=range_weights(robot.lower, robot.upper),
        avoid_singularities=bool(rng.random() < 0.7),
    )
    if rng.random() < 0.2:
        least = 0.95 * float(np.min(conditioning(robot, arm.tool, joints, characteristic_length(robot))))
        arm = replace(arm, min_conditioning=least)
    if rng.random() < 0.3:
        form = posture_form(robot)
        assert form is not None
        arm = replace(arm, posture=Posture(*path_signs(form, joints)))
    return Planted(
        Cell(Task(flange_poses(robot, joints)), (arm,), np.pi), ArmSolution(np.zeros(3), 0.0, joints), size, False
    )


def _spoilt(task: Planted, rng: np.random.Generator) -> Planted:
    """The same with a limit that leaves out what was planted by about as much as the arm is off its drawing."""
    arm, joints, i = task.arm, task.point.joints, int(rng.integers(1, 5))
    by = float(np.exp(rng.uniform(np.log(1e-5), np.log(0.3))))
    lower, upper = arm.lower.copy(), arm.upper.copy()
    if rng.random() < 0.5:
        lower[i], upper[i] = np.max(joints[:, i]) + by, max(upper[i], np.max(joints[:, i]) + by + 0.5)
    else:
        lower[i], upper[i] = min(lower[i], np.min(joints[:, i]) - by - 0.5), np.min(joints[:, i]) - by
    arm = replace(arm, lower=lower, upper=upper, reference=np.clip(arm.reference, lower, upper))
    return Planted(replace(task.cell, arms=(arm,)), task.point, task.size, True)


def own_best(task: Planted, starts: list[ArmSolution]) -> float:
    """Least objective of usable layouts that descents over the base reach on the true arm; infinite without any."""
    best = np.inf
    for start in starts:
        best = min(best, _descent(task, start))
    return best


def _descent(task: Planted, start: ArmSolution) -> float:
    """From one layout: the simplex method over the base, joints followed by Newton's method."""
    cell, arm, joints, best = task.cell, task.arm, start.joints, np.inf
    bounds = arm.base.bounds
    free = bounds[:, 1] > bounds[:, 0]
    targets = cell.flange_targets(arm)

    def cost(change: Floats) -> float:
        nonlocal best, joints
        place = np.array([*start.position, start.yaw])
        place[free] += change
        place[:3] = np.clip(place[:3], bounds[:3, 0], bounds[:3, 1])
        base = arm.base_in_world(place[:3], float(place[3]))
        q, reached = brought_to(arm.robot, joints, inverse(base) @ targets)
        if not np.all(reached):
            return 1e6
        point = ArmSolution(place[:3], float(place[3]), q)
        value = objective_of(cell, arm, q)
        beyond = float(np.sum(np.maximum(arm.lower - q, 0.0) + np.maximum(q - arm.upper, 0.0)))
        if value < best and check(cell, arm, point).usable:
            best, joints = value, q
        return value + 1e3 * arm.weight_scale * (beyond + arm.base.yaw_outside(point.yaw))

    if not np.any(free):
        cost(np.zeros(0))
        return best
    minimize(cost, np.zeros(int(np.sum(free))), method="Nelder-Mead", options={"maxfev": 150})
    return best


def attempt(seed: int) -> Record:
    """One arm and its task, answered and judged."""
    task = planted(seed)
    answer = ask(task.cell, Settings(time_limit=120.0))
    meant = nominal(task.arm.robot)
    record: Record = {
        "robot": task.arm.robot.name,
        "size": task.size,
        "off": None if meant is None else meant.position,
        "spoilt": task.spoilt,
        "drawn": meant is not None,
        **answer.record,
    }
    starts = [task.point, *_elsewhere(task, seed)]
    if answer.layout is not None and answer.layout.placements:
        (given,) = answer.layout.placements
        starts.append(ArmSolution(given.position, given.yaw, given.joints))
    known = own_best(task, starts)
    record |= {"known": None if np.isinf(known) else known, **_bound(answer)}
    return record | {"fault": fault_of(record)}


def _elsewhere(task: Planted, seed: int) -> list[ArmSolution]:
    """Layouts of the planted joints from other bases of the region."""
    rng, arm = draw_of("calibrated_arms/starts", seed), task.arm
    bounds = arm.base.bounds
    points = []
    for _ in range(STARTS):
        place = rng.uniform(bounds[:3, 0], bounds[:3, 1])
        yaw = float(rng.uniform(*bounds[3])) if not arm.base.yaw_free else float(rng.uniform(-1.0, 1.0))
        joints = task.point.joints + np.array([-yaw, *np.zeros(5)])
        points.append(ArmSolution(place, yaw, joints))
    return points


def _bound(answer: Answer) -> Record:
    proof = None if answer.layout is None else answer.layout.certificate
    if proof is None:
        return {"lower": None, "gap": None}
    return {"lower": proof.lower_bound, "gap": proof.gap}


def fault_of(record: Record) -> str:
    """What is wrong with an answer; empty if nothing is."""
    if record["word"] == "error":
        return f"error: {record['detail']}"
    if record["word"] == "infeasible" and (record["known"] is not None or not record["spoilt"]):
        return "a task that is possible is called infeasible"
    known = [value for value in (record["known"], record["objective"]) if value is not None]
    if record["lower"] is not None and known and record["lower"] > min(known) * (1.0 + 1e-6) + 1e-9:
        return "a layout costs less than the lower bound"
    return ""


def say(record: Record) -> str:
    """One line of a record."""
    gap = "-" if record["gap"] is None else f"{100.0 * record['gap']:.2g} %"
    missed = ", a better one is known" if _missed(record) else ""
    return (
        f"{record['seed']} {record['robot']} {record['size']:.1e} {record['word']} gap {gap}{missed} {record['fault']}"
    )


def _missed(record: Record) -> bool:
    return record["word"] != "error" and is_worse(record["objective"], record["known"])


def main() -> int:
    """Run the trial."""
    records = run(options_of(__doc__, 200), attempt, say)
    rows = []
    for low, high in ((1e-6, 1e-5), (1e-5, 1e-4), (1e-4, 1e-3), (1e-3, 3e-3)):
        some = [record for record in records if low <= record["size"] < high]
        gaps = [record["gap"] for record in some if record["gap"] is not None]
        words = [sum(record["word"] == word for record in some) for word in ("optimal", "feasible", "infeasible")]
        unknown = sum(record["word"] == "unknown" for record in some)
        wrong, missed = sum(bool(record["fault"]) for record in some), sum(map(_missed, some))
        median = float(np.median(gaps)) if gaps else None
        rows.append(
            (f"{low:g} to {high:g}", len(some), *words, unknown, median, max(gaps, default=None), missed, wrong)
        )
    head = ("errors [m, rad]", "tasks", "optimal", "feasible", "infeasible", "unknown", "median gap", "largest gap")
    print(table((*head, "a better one is known", "wrong"), rows))
    return int(any(record["fault"] for record in records))


if __name__ == "__main__":
    sys.exit(main())
