"""Draws of real cells: two arms of some mix, a part they carry from one place to another, and a layout that works.

The layout is drawn first, obstacles and floor are added around it later (`bench.draws.cell_furniture`), so most cells
are feasible by construction. Everything is scaled to the smaller arm of the pair. The engines of the answer are not
asked: a cell must not change when they do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bench.judges.dense_bodies import DenseBodies
from bench.judges.dense_path import ObjectSteps, follow, object_steps
from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_about, rotation_x, rotation_y, rotation_z, transform
from duocell.models.catalogue.catalogue import robot
from duocell.models.cell.cell import Cell
from duocell.models.cell.floor import Footprint
from duocell.models.cell.surroundings import Clearances, Equipment, Part, Pedestal, Surroundings
from duocell.models.cell.task import Task
from duocell.models.geometry.shapes import Body, Box, Capsule, HalfSpace
from duocell.models.robot.arm import FREE_YAW, Arm, BaseRegion, Interval, range_weights
from duocell.models.robot.robot import Robot
from duocell.optimizer.reduction.reduced import evaluate, reduced_problem

REACH = {
    "puma560": 0.85,
    "ur5e": 0.85,
    "ur10e": 1.3,
    "kr6_r900": 0.9,
    "kr210_r2700": 2.7,
    "lrmate200id": 0.72,
    "fanuc_m710ic": 2.05,
}
"""m, makers' working radii, rounded: what tasks and regions are scaled to."""
PAIRS = (
    ("puma560", "puma560"),
    ("ur5e", "ur5e"),
    ("ur10e", "ur10e"),
    ("puma560", "ur5e"),
    ("puma560", "kr6_r900"),
    ("kr6_r900", "lrmate200id"),
    ("ur5e", "kr6_r900"),
    ("ur10e", "ur5e"),
    ("lrmate200id", "ur5e"),
    ("ur10e", "puma560"),
    ("fanuc_m710ic", "ur10e"),
    ("fanuc_m710ic", "kr210_r2700"),
    ("kr210_r2700", "kr210_r2700"),
    ("kr6_r900", "kr6_r900"),
)
SPOTS, SINGLES, PAIRINGS = 400, 6, 12
"""Base positions tried per arm, layouts of one arm kept, and pairs of these tried."""
SLACK = 0.015
"""m; what the drawn layout keeps beyond the clearance, so that coarse steps do."""


@dataclass(frozen=True, eq=False)
class Known:
    """A layout that does the task.

    Attributes:
        stands: (A, 4) x, y, z [m] and yaw [rad]. joints: per arm (m, 6) rad.
    """

    stands: Floats
    joints: tuple[Floats, ...]


@dataclass(frozen=True, eq=False)
class Draw:
    """A cell without obstacles, with a layout of it.

    Attributes:
        cell: floor as half-space, part, tools, pedestals, clearances; no obstacle, no floor polygons, no couplings.
        known: a layout. tempting: the layout that would be chosen if nothing stood in the way, roughly.
        steps: coarse samples of the object. paths: per arm (K, 6) rad of the known layout there.
        scale: m, working radius of the smaller arm.
    """

    cell: Cell
    known: Known
    tempting: Known
    steps: ObjectSteps
    paths: tuple[Floats, ...]
    scale: float


def draw(rng: np.random.Generator, names: tuple[str, str]) -> Draw:
    """Tasks and places until two arms of these names do the task without touching anything."""
    while True:
        found = _try(rng, names)
        if found is not None:
            return found


def coarse(task: Task, scale: float) -> ObjectSteps:
    """Samples of the object for drawing: some tens of them."""
    return object_steps(task.poses, 0.03 * scale, 0.1)


def base_frames(cell: Cell, stands: Floats) -> Floats:
    """(A, 4, 4) bases in the world."""
    return np.array([arm.base_in_world(s[:3], s[3]) for arm, s in zip(cell.arms, stands, strict=True)])


def keeps_clear(cell: Cell, stands: Floats, paths: tuple[Floats, ...], steps: ObjectSteps, slack: float) -> bool:
    """True if every class keeps its clearance and ``slack`` more at all samples."""
    bodies = DenseBodies(cell, base_frames(cell, stands))
    clearances = cell.surroundings.clearances
    kinds = {kind for kind, _, _ in bodies.pairs}
    least = {k: getattr(clearances, "self_collision" if k == "self" else k) + slack * (k != "self") for k in kinds}
    return not any(
        bodies.nearest(bodies.place([path[k] for path in paths], pose), least) for k, pose in enumerate(steps.poses)
    )


# --- arms and task ----------------------------------------------------------------------------------------------------


def _try(rng: np.random.Generator, names: tuple[str, str]) -> Draw | None:
    scale = min(REACH[name] for name in names)
    length = scale * rng.uniform(0.7, 1.1)
    flat = rng.random() < 0.3  # a plate, else a beam
    across, thick = (0.4 * length, 0.03 * scale) if flat else (0.07 * scale, 0.07 * scale)
    part = Part((Body("plate" if flat else "beam", np.eye(4), Box(np.array([length, across, thick]))),), 0.14 * scale)
    heights = [_height(name, scale, rng) for name in names]
    z_free, raised = rng.random() < 0.2, [name == "puma560" or rng.random() < 0.6 for name in names]
    if (names[0] == "puma560") == (names[1] == "puma560") and rng.random() < 0.7:  # alike, so couplings can ask for it
        heights, raised = [heights[0]] * 2, [raised[0]] * 2
    task = _task(rng, scale, float(np.mean(heights)))
    grasps = _grasps(rng, length, thick)
    arms, equipment = [], {}
    for name, title, grasp, height, up in zip(names, ("main", "follower"), grasps, heights, raised, strict=True):
        body, tool = _tool(robot(name), scale)
        region = _region(task, scale, REACH[name], height, z_free)
        arms.append(_arm(title, robot(name), tool, grasp, region))
        pedestal = _pedestal(rng, height, REACH[name]) if up and not z_free else None
        equipment[title] = Equipment((body,), pedestal)
        if pedestal is None and not z_free:  # bolted to the floor
            arms[-1] = replace(arms[-1], base=replace(region, z=Interval(0.0, 0.0)))
    floor = Body("floor", np.eye(4), HalfSpace())
    around = Surroundings((floor,), part, None, _clearances(rng), equipment)
    cell = Cell(task, tuple(arms), surroundings=around)
    return _with_layout(rng, cell, scale, same_height=z_free)


def _height(name: str, scale: float, rng: np.random.Generator) -> float:
    """m, of a base origin above the floor; the PUMA's is at its shoulder."""
    return float(rng.uniform(0.55, 0.75) if name == "puma560" else rng.uniform(0.2, 0.5) * min(scale, 1.3))


def _task(rng: np.random.Generator, scale: float, base: float) -> Task:
    """Lift, carry and turn, lower: 5 to 20 poses."""
    heading, away = rng.uniform(-np.pi, np.pi), scale * rng.uniform(0.25, 0.8)
    pick = np.array([*rng.uniform(-0.2, 0.2, 2), base + scale * rng.uniform(0.05, 0.45)])
    place = pick + np.array([away * np.cos(heading), away * np.sin(heading), scale * rng.uniform(-0.1, 0.1)])
    top = max(pick[2], place[2]) + scale * rng.uniform(0.08, 0.25)
    corners = np.array([pick, [*pick[:2], top], [*place[:2], top], place])
    turn, tilt = rng.uniform(-1.0, 1.0), rng.uniform(-0.2, 0.2)
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    at = np.linspace(0.0, way[-1], int(rng.integers(5, 21)))
    positions = np.stack([np.interp(at, way, corners[:, axis]) for axis in range(3)], axis=1)
    carried = np.interp(at, way, [0.0, 0.0, 1.0, 1.0])
    first = rotation_z(rng.uniform(-np.pi, np.pi))
    rotations = first @ rotation_z(turn * carried) @ rotation_x(tilt * np.sin(np.pi * carried))
    return Task(transform(rotations, positions))


def _grasps(rng: np.random.Generator, length: float, thick: float) -> list[Floats]:
    """Both ends of the part, from above and inclined, or from the ends."""
    from_ends = rng.random() < 0.35
    grasps = []
    for side in (-1.0, 1.0):
        down = rotation_x(np.pi + rng.uniform(-0.5, 0.5)) @ rotation_z(rng.uniform(-np.pi, np.pi))
        if from_ends:
            inwards = rotation_y(-side * np.pi / 2) @ rotation_z(rng.uniform(-np.pi, np.pi))
            grasps.append(transform(inwards, [0.5 * side * length, 0.0, 0.0]))
        else:
            grasps.append(transform(down, [0.42 * side * length, 0.0, 0.5 * thick]))
    return grasps


def _tool(chosen: Robot, scale: float) -> tuple[Body, Floats]:
    """A gripper that ends at the TCP, and the TCP in the flange frame, z outwards; makers' flanges differ."""
    axis = chosen.flange_placement[:3, :3].T @ chosen.joint_axes[-1]
    # Away from the wrist, or, where the flange is at the wrist's centre, towards where the forearm points at zero.
    back = chosen.joint_placements[-1][:3, 3] + chosen.joint_placements[-1][:3, :3] @ chosen.flange_placement[:3, 3]
    outwards = chosen.joint_placements[-1][:3, :3] @ chosen.joint_axes[-1]
    out = axis if float(back @ outwards) >= 0.0 else -axis
    turn = np.eye(3) if out[2] > 0.999 else rotation_about(np.cross([0.0, 0.0, 1.0], out), float(np.arccos(out[2])))
    long, radius = 0.14 * scale, 0.035 * scale
    body = Body("gripper", transform(turn, out * (0.5 * long)), Capsule(radius, long - 2.0 * radius))
    return body, transform(turn, out * long)


def _region(task: Task, scale: float, reach: float, height: float, z_free: bool) -> BaseRegion:
    middle = task.poses[:, :2, 3].mean(axis=0)
    half = 0.5 * scale + 0.8 * reach
    x, y = (Interval(float(c) - half, float(c) + half) for c in middle)
    z = Interval(height, height + 0.15 * scale) if z_free else Interval(height, height)
    return BaseRegion(x, y, z, FREE_YAW)


def _pedestal(rng: np.random.Generator, height: float, reach: float) -> Pedestal:
    size = float(rng.uniform(0.2, 0.3)) * min(reach, 1.5)
    foot = Footprint.disc(0.5 * size) if rng.random() < 0.5 else Footprint.rectangle(size, size)
    return Pedestal(height, foot)


def _clearances(rng: np.random.Generator) -> Clearances:
    return Clearances(
        arm_arm=float(rng.choice([0.02, 0.03])),
        arm_part=None if rng.random() < 0.2 else 0.02,
        arm_obstacle=float(rng.choice([0.02, 0.03])),
        part_obstacle=float(rng.choice([0.01, 0.02])),
        self_collision=None if rng.random() < 0.3 else 0.0,
    )


def _arm(name: str, chosen: Robot, tool: Floats, grasp: Floats, region: BaseRegion) -> Arm:
    lower, upper = chosen.lower, chosen.upper
    weights = range_weights(lower, upper)
    return Arm(name, chosen, tool, grasp, region, lower, upper, chosen.reference, weights)


# --- a layout ---------------------------------------------------------------------------------------------------------


def _with_layout(rng: np.random.Generator, cell: Cell, scale: float, same_height: bool) -> Draw | None:
    """Layouts of single arms at random, then pairs of them that keep clear of each other."""
    steps = coarse(cell.task, scale)
    height = float(rng.uniform(cell.arms[0].base.z.low, cell.arms[0].base.z.high)) if same_height else None
    singles, best = [], []
    for arm in cell.arms:
        stands, joints, objective = _stands(rng, cell, arm, height)
        if len(stands) == 0:
            return None
        first = int(np.argmin(objective))
        best.append((stands[first], joints[first]))
        kept = []
        alone = replace(cell, arms=(arm,))
        for k in rng.permutation(len(stands))[: 6 * SINGLES]:
            path, lost = follow(arm, arm.base_in_world(stands[k][:3], stands[k][3]), steps, joints[k])
            if lost is None and keeps_clear(alone, stands[k][None], (path,), steps, SLACK):
                kept.append((stands[k], joints[k], path))
            if len(kept) == SINGLES:
                break
        singles.append(kept)
    if not all(singles):
        return None
    for _ in range(PAIRINGS):
        pair = [kept[rng.integers(len(kept))] for kept in singles]
        stands, paths = np.array([one[0] for one in pair]), tuple(one[2] for one in pair)
        if keeps_clear(cell, stands, paths, steps, SLACK):
            known = Known(stands, tuple(one[1] for one in pair))
            tempting = Known(np.array([b[0] for b in best]), tuple(b[1] for b in best))
            return Draw(cell, known, tempting, steps, paths, scale)
    return None


def _stands(rng: np.random.Generator, cell: Cell, arm: Arm, height: float | None) -> tuple[Floats, Floats, Floats]:
    """Random bases from which the arm does the task: (k, 4) with yaws, (k, m, 6) rad, and (k,) E."""
    problem = reduced_problem(cell, arm)
    if problem is None:
        raise AssertionError(f"{arm.robot.name} has no closed form")
    bounds = arm.base.bounds[:3]
    spots = rng.uniform(bounds[:, 0], bounds[:, 1], (SPOTS, 3))
    if height is not None:
        spots[:, 2] = np.clip(height, bounds[2, 0], bounds[2, 1])
    found = evaluate(problem, spots)
    posture, spot = np.nonzero(found.violation == 0.0)
    stands = np.column_stack([spots[spot], found.yaw[posture, spot]])
    return stands, found.joints[:, posture, spot].transpose(1, 2, 0), found.objective[posture, spot]
