"""Changes of a request that may help, and the cell that each of them makes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import degrees, pi, radians

import numpy as np

from models.arm import Arm, BaseRegion, Interval, range_weights
from models.cell import Cell
from models.floor import Floor
from models.pose import rotation_z, transform
from models.posture import Posture
from models.surroundings import Clearances, PairClass
from optimizer.box import reach_windows
from optimizer.why_not.elements import Element, Kind, Selection, arms_of

REGION_STEPS = (1.0, 0.5, 0.2)
"""m that a base may stand farther out."""
HEIGHT_STEP = 0.2
"""m that a base is put higher or lower."""
LIMIT_STEPS = (radians(45.0), radians(15.0))
"""rad that a joint may turn farther, either way."""
STEP_FACTORS = (3.0, 1.5)
"""On max_joint_step, which stays below a half turn."""
CLEARANCE_SHARES = (0.0, 0.25, 0.5, 0.75)
"""Of a clearance that is asked for."""
TURNS = (2, 1, 3)
"""Quarter turns of a grasp."""


@dataclass(frozen=True, eq=False, slots=True)
class Change:
    """One change.

    Attributes:
        what: one sentence for people. pointer: JSON pointer to the field of the request.
        cell: the changed cell.
        undone: elements that it takes away or loosens; layouts that break nothing else may do.
    """

    what: str
    pointer: str
    cell: Cell
    undone: frozenset[Element] = frozenset()


Ladder = tuple[Change, ...]
"""Changes of one sort, the largest first: where it does not help, the smaller ones do not either."""


def changes(cell: Cell, conflict: Selection) -> Iterator[Ladder]:
    """What may resolve a conflict, the surest first.

    Args:
        cell: the whole cell. conflict: what blocks it.
    """
    for element in sorted(conflict.elements, key=lambda e: list(Kind).index(e.kind), reverse=True):
        yield from ((change,) for change in _without(cell, element))
    for element in conflict.elements:
        yield from _loosened(cell, element)
    yield from _clearances(cell, conflict)
    for a in arms_of(cell, conflict):
        yield from ((change,) for change in _grasps(cell, a))
        yield from ((change,) for change in _heights(cell, a))


def _without(cell: Cell, element: Element) -> Iterator[Change]:
    """The cell without something that can be left out."""
    around, k, undone = cell.surroundings, element.index, frozenset({element})
    words = element.words(cell)
    match element.kind:
        case Kind.OBSTACLE:
            kept = tuple(o for i, o in enumerate(around.obstacles) if i != k)
            new = replace(cell, surroundings=replace(around, obstacles=kept))
            yield Change(f"remove {words}, or move it away", f"/obstacles/{k}", new, undone)
        case Kind.COUPLING:
            couplings = tuple(c for i, c in enumerate(cell.couplings) if i != k)
            yield Change(f"drop {words}", f"/coupling/{k}", replace(cell, couplings=couplings), undone)
        case Kind.FLOOR:
            new = replace(cell, surroundings=replace(around, floor=None))
            yield Change("allow bases to stand anywhere on the floor", "/floor", new, undone)
            yield from _floors(cell, undone)
        case Kind.POSTURE:
            new = _with_arm(cell, k, replace(cell.arms[k], posture=Posture()))
            yield Change(f"leave {words} free", f"/arms/{k}/posture", new, undone)
        case Kind.CONDITIONING:
            new = _with_arm(cell, k, replace(cell.arms[k], min_conditioning=None))
            yield Change(f"do not ask for {words}", f"/arms/{k}/min_conditioning", new, undone)
        case _:
            return


def _floors(cell: Cell, undone: frozenset[Element]) -> Iterator[Change]:
    """The cell without the margin, and without one forbidden polygon."""
    around = cell.surroundings
    floor = around.floor
    if floor is None:
        return

    def with_floor(what: str, pointer: str, other: Floor) -> Change:
        return Change(what, pointer, replace(cell, surroundings=replace(around, floor=other)), undone)

    if floor.margin > 0.0:
        lower = Floor(floor.allowed, floor.forbidden, 0.0)
        yield with_floor(f"ask for no margin on the floor instead of {floor.margin:g} m", "/floor/margin", lower)
    for k in range(len(floor.forbidden)) if len(floor.forbidden) > 1 or floor.allowed is not None else ():
        fewer = tuple(polygon for i, polygon in enumerate(floor.forbidden) if i != k)
        yield with_floor(
            f"allow bases to stand on forbidden floor {k}",
            f"/floor/forbidden/{k}",
            Floor(floor.allowed, fewer, floor.margin),
        )


def _loosened(cell: Cell, element: Element) -> Iterator[Ladder]:
    """The cell with something made wider by steps."""
    a, undone = element.index, frozenset({element})
    match element.kind:
        case Kind.REGION:
            missing = _out_of_reach(cell, cell.arms[a])
            yield tuple(
                Change(
                    f"allow {cell.arms[a].name} to stand up to {missing + step:.2g} m farther out",
                    f"/arms/{a}/base",
                    _with_arm(cell, a, _wider(cell.arms[a], missing + step)),
                    undone,
                )
                for step in REGION_STEPS
            )
        case Kind.LIMITS:
            joint = cell.arms[a].robot.joint_names[element.joint]
            yield tuple(
                Change(
                    f"let {joint} of {cell.arms[a].name} turn {degrees(step):.0f}° farther either way",
                    f"/arms/{a}/limits/{element.joint}",
                    _with_arm(cell, a, _freer(cell.arms[a], element.joint, step)),
                    undone,
                )
                for step in LIMIT_STEPS
            )
        case Kind.STEP:
            steps = [min(factor * cell.max_joint_step, pi) for factor in STEP_FACTORS]
            yield tuple(
                Change(
                    f"allow joint steps of {step:.2f} rad, or add poses between",
                    "/max_joint_step",
                    replace(cell, max_joint_step=step),
                    undone,
                )
                for step in steps
            )
        case _:
            return


def _clearances(cell: Cell, conflict: Selection) -> Iterator[Ladder]:
    """Smaller distances between what the conflict names."""
    kinds = {element.kind for element in conflict.elements}
    arms = len(arms_of(cell, conflict))
    concerned = {
        PairClass.ARM_ARM: arms > 1,
        PairClass.ARM_PART: arms > 0 and Kind.PART in kinds,
        PairClass.ARM_OBSTACLE: arms > 0 and Kind.OBSTACLE in kinds,
        PairClass.PART_OBSTACLE: {Kind.PART, Kind.OBSTACLE} <= kinds,
        PairClass.SELF: Kind.SELF in kinds,
    }
    asked = cell.surroundings.clearances
    for kind, of_interest in concerned.items():
        required = asked.required(kind)
        if of_interest and required:
            yield tuple(
                Change(
                    f"ask for {1e3 * less:g} mm instead of {1e3 * required:g} mm of {kind} clearance",
                    f"/clearance/{kind}",
                    _with_clearance(cell, kind, less),
                )
                for less in (share * required for share in CLEARANCE_SHARES)
            )


def _with_clearance(cell: Cell, kind: PairClass, required: float) -> Cell:
    field = "self_collision" if kind is PairClass.SELF else str(kind)
    asked: Clearances = replace(cell.surroundings.clearances, **{field: required})
    return replace(cell, surroundings=replace(cell.surroundings, clearances=asked))


def _grasps(cell: Cell, a: int) -> Iterator[Change]:
    """The same grip, turned about the tool's axis."""
    arm = cell.arms[a]
    for quarter in TURNS:
        turn = transform(rotation_z(quarter * pi / 2), np.zeros(3))
        turned = replace(arm, grasp=arm.grasp @ turn, grasps=None if arm.grasps is None else arm.grasps @ turn)
        yield Change(
            f"turn the grasp of {arm.name} by {90 * quarter if quarter < 3 else -90}° about the z axis of its tool",
            f"/arms/{a}/grasp/orientation",
            _with_arm(cell, a, turned),
        )


def _heights(cell: Cell, a: int) -> Iterator[Change]:
    """The base put higher or lower, on its pedestal if it has one."""
    arm, around = cell.arms[a], cell.surroundings
    own = around.of(arm.name)
    for step in (HEIGHT_STEP, -HEIGHT_STEP):
        z = arm.base.z
        raised = replace(arm.base, z=Interval(z.low + step, z.high + step))
        what = f"put {arm.name} {abs(step):g} m {'higher' if step > 0.0 else 'lower'}"
        new, pointer = _with_arm(cell, a, replace(arm, base=raised)), f"/arms/{a}/base/z"
        if own.pedestal is not None:
            height = own.pedestal.height + step
            if height <= 0.0:
                continue
            equipment = {**around.equipment, arm.name: replace(own, pedestal=replace(own.pedestal, height=height))}
            new = replace(new, surroundings=replace(around, equipment=equipment))
            what, pointer = f"{what}, on a pedestal of {height:g} m", f"/arms/{a}/pedestal/height"
        yield Change(what, pointer, new)


def _with_arm(cell: Cell, a: int, arm: Arm) -> Cell:
    return replace(cell, arms=(*cell.arms[:a], arm, *cell.arms[a + 1 :]))


def _out_of_reach(cell: Cell, arm: Arm) -> float:
    """m that a region lacks along x or y to let the arm reach every pose from somewhere, whatever else there is."""
    windows = reach_windows(cell, arm)[:, :2]
    region = arm.base.bounds[:2]
    lack = np.maximum(np.max(windows[..., 0], axis=0) - region[:, 1], region[:, 0] - np.min(windows[..., 1], axis=0))
    return max(float(np.ceil(10.0 * np.max(lack)) / 10.0), 0.0)


def _wider(arm: Arm, step: float) -> Arm:
    base = arm.base
    x, y = (Interval(side.low - step, side.high + step) for side in (base.x, base.y))
    return replace(arm, base=BaseRegion(x, y, base.z, base.yaw))


def _freer(arm: Arm, joint: int, step: float) -> Arm:
    more = step * (np.arange(arm.dof) == joint)
    lower, upper = arm.lower - more, arm.upper + more
    by_range = np.array_equal(arm.weights, range_weights(arm.lower, arm.upper))  # as the request would get them
    return replace(arm, lower=lower, upper=upper, weights=range_weights(lower, upper) if by_range else arm.weights)
