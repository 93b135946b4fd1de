"""Station tasks by chance: five places where the hand of one arm stands still, among furniture.

Boxes, a shelf, a cross of beams, an oven or a house without one wall and floor; the arm, its region and the distances
asked for are those of the acceptance case ``stations_house``. Stations are drawn as joints of an arm that touches
nothing, all from one base, so that every task has a layout.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bench.judges.dense_bodies import DenseBodies
from bench.judges.dense_check import base_in_world
from bench.searches.own_stands import OwnTask, own_stands, own_task
from bench.trials.acceptance_search import case
from bench.trials.trial import draw_of
from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.geometry.shapes import Body, Box
from duocell.models.kinematics.kinematics import flange_poses

NAME = "stations"
STATIONS = 5
TRIES = 1000
"""Draws of joints for the stations of one base."""
INSIDE = 4
"""At most so many stations have to be in the box around the furniture."""
ROOM = 0.9
"""m; stations are not farther than this from the middle, in any direction."""

Furniture = list[tuple[Floats, Floats]]
"""Boxes: centre and size, (3,) m."""


@dataclass(frozen=True, eq=False)
class StationTask:
    """A task with the layout it was made around: kind of furniture, cell, stand (4,), joints (m, 6)."""

    kind: str
    cell: Cell
    stand: Floats
    joints: Floats


def station_task(seed: int) -> StationTask:
    """Task ``seed``; the kinds take turns."""
    rng = draw_of(NAME, seed)
    kind = list(KINDS)[seed % len(KINDS)]
    while True:
        boxes = KINDS[kind](rng)
        bodies = tuple(_box(f"{kind}{i}", *box) for i, box in enumerate(boxes))
        for _ in range(20):
            drawn = _with_stations(rng, kind, bodies)
            if drawn is not None:
                return drawn


def is_clean(cell: Cell, bodies: DenseBodies, joints: Floats) -> bool:
    """True if nothing that must keep apart is too near at any of the joints (m, 6); the part is where it may be."""
    around = cell.surroundings.clearances
    kept = {"arm_obstacle": around.arm_obstacle or 0.0, "self": around.self_collision or 0.0}
    return not any(bodies.nearest(bodies.place([q], np.eye(4)), kept) for q in joints)


def bodies_at(cell: Cell, stand: Floats) -> DenseBodies:
    """The bodies of a cell of one arm for a stand (4,)."""
    return DenseBodies(cell, base_in_world(cell.arms[0], stand)[None])


# --- the draw ---------------------------------------------------------------------------------------------------------


def _with_stations(rng: np.random.Generator, kind: str, bodies: tuple[Body, ...]) -> StationTask | None:
    """Stations from one base, or None if there are none."""
    template = case("stations_house").cell
    cell = replace(template, name=f"stations {kind}", surroundings=replace(template.surroundings, obstacles=bodies))
    arm = cell.arms[0]
    stand = np.array([*rng.uniform(-1.0, 1.0, 3), rng.uniform(-np.pi, np.pi)])
    dense, base = bodies_at(cell, stand), base_in_world(arm, stand)
    wanted = int(rng.integers(0, INSIDE + 1))
    low, high = _around(bodies)
    chosen: list[Floats] = []
    signs = rng.integers(0, 8)
    for joints in rng.uniform(np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi), (TRIES, arm.dof)):
        hand = base @ flange_poses(arm.robot, joints[None])[0]
        place = hand[:3, 3]
        inside = bool(np.all((place > low) & (place < high)))
        if np.any(np.abs(place) > ROOM) or (len(chosen) < wanted and not inside):
            continue
        same = _in_branch(cell, stand, hand, int(signs))
        if same is not None and is_clean(cell, dense, same[None]):
            chosen.append(same)
            if len(chosen) == STATIONS:
                return _task(kind, cell, stand, base @ flange_poses(arm.robot, np.array(chosen)), np.array(chosen))
    return None


def _in_branch(cell: Cell, stand: Floats, hand: Floats, branch: int) -> Floats | None:
    """The joints (6,) of one branch for a hand, None if they are not usable."""
    task = own_task(replace(cell, task=Task(np.stack([hand, hand]))), 0)
    stands = own_stands(task, stand[None, :3], stand[3:])
    joints: Floats = stands.joints[branch, 0, 0]
    return joints if stands.usable[branch, 0] else None


def _task(kind: str, cell: Cell, stand: Floats, hands: Floats, joints: Floats) -> StationTask:
    """Each station's pose twice, a segment each."""
    starts = tuple(range(0, 2 * STATIONS, 2))
    names = tuple(f"station {k + 1}" for k in range(STATIONS))
    task = Task(np.repeat(hands, 2, axis=0), starts, names)
    return StationTask(kind, replace(cell, task=task), stand, np.repeat(joints, 2, axis=0))


def own_station_task(task: StationTask) -> OwnTask:
    """The only arm's part."""
    return own_task(task.cell, 0)


def _box(name: str, centre: Floats, size: Floats) -> Body:
    pose = np.eye(4)
    pose[:3, 3] = centre
    return Body(name, pose, Box(size))


def _around(bodies: tuple[Body, ...]) -> tuple[Floats, Floats]:
    """Corners of the box around all boxes."""
    middles = np.array([body.pose[:3, 3] for body in bodies])
    halves = np.array([0.5 * body.shape.size for body in bodies if isinstance(body.shape, Box)])
    return (middles - halves).min(axis=0), (middles + halves).max(axis=0)


def _boxes(rng: np.random.Generator) -> Furniture:
    return [(rng.uniform(-0.8, 0.8, 3), rng.uniform(0.08, 0.45, 3)) for _ in range(rng.integers(4, 13))]


def _shelf(rng: np.random.Generator) -> Furniture:
    """Two sides, a back and some boards, open towards the front, which is one of four sides."""
    width, depth, height = rng.uniform(0.6, 1.0), rng.uniform(0.25, 0.4), rng.uniform(0.8, 1.4)
    thick, boards = 0.03, int(rng.integers(3, 5))
    made = [(np.array([s * 0.5 * width, 0.0, 0.0]), np.array([thick, depth, height])) for s in (-1.0, 1.0)]
    made.append((np.array([0.0, 0.5 * depth, 0.0]), np.array([width, thick, height])))
    levels = np.linspace(-0.5 * height, 0.5 * height, boards)
    made += [(np.array([0.0, 0.0, z]), np.array([width, depth, thick])) for z in levels]
    return _moved(rng, made, 0.5)


def _cross(rng: np.random.Generator) -> Furniture:
    """Two or three long beams that meet."""
    made = []
    for axis in rng.permutation(3)[: rng.integers(2, 4)]:
        size = rng.uniform(0.06, 0.15, 3)
        size[axis] = rng.uniform(1.2, 2.0)
        made.append((np.zeros(3), size))
    return _moved(rng, made, 0.4)


def _oven(rng: np.random.Generator) -> Furniture:
    """A box without front."""
    size, thick = rng.uniform(0.5, 0.9, 3), 0.04
    made = []
    for axis, sign in ((0, -1.0), (0, 1.0), (1, 1.0), (2, -1.0), (2, 1.0)):
        centre, wall = np.zeros(3), size.copy()
        centre[axis], wall[axis] = sign * 0.5 * size[axis], thick
        made.append((centre, wall))
    return _moved(rng, made, 0.4)


def _house(rng: np.random.Generator) -> Furniture:
    """Three walls and a roof."""
    side, thick = rng.uniform(0.9, 1.3), 0.04
    made = []
    for axis, sign in ((0, 1.0), (0, -1.0), (1, 1.0), (2, 1.0)):
        centre, wall = np.zeros(3), np.full(3, side)
        centre[axis], wall[axis] = sign * 0.5 * side, thick
        made.append((centre, wall))
    return _moved(rng, made, 0.25)


def _moved(rng: np.random.Generator, made: Furniture, most: float) -> Furniture:
    """Turned by quarters about the vertical and shifted."""
    shift, quarters = rng.uniform(-most, most, 3), int(rng.integers(4))
    cosine, sine = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[quarters]
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return [(turn @ centre + shift, np.abs(turn) @ size) for centre, size in made]


KINDS: dict[str, Callable[[np.random.Generator], Furniture]] = {
    "boxes": _boxes,
    "shelf": _shelf,
    "cross": _cross,
    "oven": _oven,
    "house": _house,
}
