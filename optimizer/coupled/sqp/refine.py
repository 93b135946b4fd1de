"""From a start to the nearest best layout that keeps every distance: sequential quadratic programs.

Every iterate is a real layout: its arms are exactly on their tasks (`manifold`). Around it the objective is a quadratic
and all constraints are linear rows, renewed at every step; a trust region and one slack for all rows keep that honest.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from models.arrays import Floats
from models.cell import Cell
from models.surroundings import PairClass
from optimizer.clearance import PathClearance
from optimizer.coupled.scene import LIMITS, Scene
from optimizer.coupled.sqp.linear_rows import LinearRows
from optimizer.coupled.sqp.look import Look, look
from optimizer.coupled.sqp.manifold import Unknowns, move
from optimizer.coupled.sqp.quadratic import Quadratic, quadratic
from optimizer.coupled.sqp.samples import sample_path
from optimizer.coupled.sqp.step import Step, best_step
from optimizer.events import Iterated
from optimizer.measure import placed
from optimizer.program import ArmPoint
from optimizer.watch import check_stop, tell

ROUNDS = 50
"""Programs that one refinement may solve for one set of cushions."""
RADIUS, SMALLEST_RADIUS, LARGEST_RADIUS = 0.1, 1e-5, 0.4
"""m that a base may move in a round along each axis: at first, before giving up, at most."""
TURN, SPARE = 3.0, 3.0
"""rad per m of that radius that a base may turn, and that a joint may move by the spare motion of a redundant arm."""
WORTH = 1e-5
"""Relative fall of the merit below which a round was the last one."""
STUCK = 6, 0.1
"""Rounds over which the violation of a layout that still has one must fall by this share."""
POOR, GOOD = 0.25, 0.75
"""Share of the promised fall below which the radius shrinks, above which it grows."""
SAME_BASIN = 0.01
"""m; layouts in the same postures whose bases are nearer than this to each other lead to one optimum."""
NEARER, BEYOND = 3, 1.5
"""How often a step that ends beyond an arm's reach is made anew, and how much more than it missed is asked for."""
CUSHION = 1e-4
"""m asked for beyond the required distance, for what the linear rows leave out."""
PATIENCE, SETTLED = 20.0, 3
"""A descent that would need more than so many rounds like the one before it to beat what is known is given up, though
not in its first rounds."""
DIPS = 5
"""How often a path that dips between its samples is sent back with more cushion."""
FARTHER, SINGULAR = 2.0, 5e-3
"""Factor on the smallest conditioning of an arm that loses its way, and what is asked for at least."""
PRICE, DEARER = 100.0, 10.0
"""Cost of a metre or radian of violation, per pose and unit of weight; and how much dearer it gets where that is too
little to end a violation."""
SAFE = 100.0
"""Factor on the price at which a descent that lost a layout without violation is tried once more from there."""
NEARLY, HOPELESS = 1e-3, 0.03
"""m or rad; what violates less is worth the full check, what violates more is given up."""


@dataclass(frozen=True, eq=False, slots=True)
class Refined:
    """Where a refinement ended.

    Attributes:
        points: one per arm. objective: E. lack: largest violation met at the samples, <= 0 if none.
        clean: True if the layout passed every check. clearance: the path check of a layout that is clean or nearly so.
        rounds: programs solved.
    """

    points: tuple[ArmPoint, ...]
    objective: float
    lack: float
    clean: bool
    clearance: PathClearance | None
    rounds: int


def price_of(cell: Cell) -> float:
    """Cost of a metre or radian of violation, in units of E."""
    weights = [arm.weight_scale for arm in cell.arms]
    return PRICE * cell.task.total_weight * sum(weights) / len(weights)


def refine(
    scene: Scene,
    start: Sequence[ArmPoint],
    deadline: float,
    known: Sequence[Refined] = (),
    beat: float = np.inf,
) -> Refined:
    """Improve a layout until it is clean and locally best, or no longer gets better.

    Args:
        scene: the cell. start: one point per arm, each on its task. deadline: `time.perf_counter` value, soft.
        known: where other starts ended; one that the way leads to is the answer, without going all of it.
        beat: E; a way that does not seem to lead to less is not gone to its end.
    """
    cushions = dict.fromkeys(PairClass, CUSHION)
    asked, cell, price = scene, scene.cell, price_of(scene.cell)
    best: Refined | None = None
    safe: Look | None = None  # kept all distances at the samples; the way down must not lose that for good
    points, rounds = tuple(start), 0
    for _ in range(DIPS + 1):
        seen = look(asked, Unknowns.of(cell), points, cushions)
        safe = seen if safe is None and best is None and seen.lack <= 0.0 else safe
        here, used = _descend(asked, seen, cushions, price, deadline, known, beat)
        rounds += used
        for other in known:
            if nearby(here.points, other.points, SAME_BASIN):
                return other
        if here.objective > beat:
            break
        if here.lack > HOPELESS or (best is None and here.lack > NEARLY and price > price_of(cell)):
            if safe is None or best is not None or price >= SAFE * price_of(cell):
                break
            points, price = safe.points, SAFE * price_of(cell)
            continue
        points = here.points
        if here.lack > NEARLY:
            price *= DEARER
            continue
        best = _judged(scene, here, rounds)
        if best.clean or time.perf_counter() > deadline:
            break
        if best.clearance is not None:
            for found in best.clearance.classes:
                if not found.clear:
                    cushions[found.kind] += 1.2 * (found.required - found.distance) + CUSHION
            asked = _with_worst_limit(asked, best.clearance)
            followed = _with_breaks(asked, best.clearance, start)
            if followed is not None:
                asked, points = followed, tuple(start)
            else:
                asked = _away_from_singularities(asked, best.clearance, points)
        price *= DEARER
    return best or Refined(here.points, here.objective, here.lack, False, None, rounds)


def _judged(scene: Scene, here: Look, rounds: int) -> Refined:
    """A layout that nearly holds everything, after the full check of its path."""
    clearance = scene.certify(here.points)
    lack = max(scene.tie_lack(here.points), scene.floor_lack(here.points))
    clean = lack <= LIMITS and scene.usable(here.points) and _passes(clearance)
    return Refined(here.points, here.objective, max(lack, here.lack if not clean else lack), clean, clearance, rounds)


def _away_from_singularities(scene: Scene, clearance: PathClearance, points: Sequence[ArmPoint]) -> Scene:
    """The scene with arms that lose their way between two poses kept farther from singularities, where that happens."""
    lost = {one.arm for one in clearance.breaks}
    arms = []
    for arm, point in zip(scene.cell.arms, points, strict=True):
        if arm.name in lost:
            now = placed(scene.cell, arm, point).minimum_conditioning
            arm = replace(arm, min_conditioning=max(FARTHER * now, SINGULAR, arm.min_conditioning or 0.0))
        arms.append(arm)
    return replace(scene, cell=replace(scene.cell, arms=tuple(arms)))


def _with_worst_limit(scene: Scene, clearance: PathClearance) -> Scene:
    """The scene with the place at which a joint leaves its limits between the samples for another sample."""
    worst = clearance.worst_limit
    if worst.amount <= LIMITS or not 0.0 < worst.fraction < 1.0:
        return scene
    return replace(scene, between=(*scene.between, (worst.pose, worst.fraction)))


def _with_breaks(scene: Scene, clearance: PathClearance, start: Sequence[ArmPoint]) -> Scene | None:
    """The scene with the places at which an arm lost its way for more samples; None where it loses it from the start.

    Beyond the end of reach there is no slope to go back by: the way down is gone once more, with these places in view.
    """
    new = {(one.pose, one.fraction) for one in clearance.breaks if 0.0 < one.fraction < 1.0} - set(scene.between)
    if not new:
        return None
    closer = replace(scene, between=(*scene.between, *sorted(new)))
    samples = sample_path(scene.cell, scene.path, scene.bases(start), start, closer.between)
    return closer if samples.followed else None


def nearby(points: Sequence[ArmPoint], others: Sequence[ArmPoint], distance: float) -> bool:
    """True for layouts in the same postures whose bases are nearer than ``distance`` [m] to each other."""
    return all(
        p.signs == q.signs and float(np.max(np.abs(p.position - q.position))) < distance
        for p, q in zip(points, others, strict=True)
    )


def _passes(clearance: PathClearance) -> bool:
    return clearance.clear and clearance.limit_excess <= LIMITS


def _descend(
    scene: Scene,
    here: Look,
    cushions: dict[PairClass, float],
    price: float,
    deadline: float,
    known: Sequence[Refined],
    beat: float,
) -> tuple[Look, int]:
    """Trust-region steps on the merit ``E + price · max(0, lack)``."""
    unknowns, radius = Unknowns.of(scene.cell), RADIUS
    merit, lacks = _merit(here, price), [here.lack]
    model: Quadratic | None = None
    for round_ in range(ROUNDS):
        check_stop()
        tell(Iterated(round_, here.objective, max(here.lack, 0.0)))
        if radius < SMALLEST_RADIUS or time.perf_counter() > deadline or _stuck(lacks):
            return here, round_
        model = model or quadratic(scene.cell, here.points, here.along, unknowns)
        bounds = _reach(scene.cell, here.points, unknowns, radius)
        step, moved, straight = _step(scene, here, model, here.rows, bounds, price)
        if step is None or moved is None:
            radius *= 0.3
            continue
        promised = price * (max(here.lack, 0.0) - step.slack) - model.change(step.step)
        if promised <= WORTH * max(merit, 1e-9) and not straight:
            radius *= 0.3
            continue
        there = look(scene, unknowns, moved, cushions)
        if here.followed and not there.followed:
            radius *= 0.3
            continue
        gained = merit - _merit(there, price)
        if gained < POOR * promised and there.lack > max(here.lack, 0.0):
            bent = _bent(scene, here, there, model, step, bounds, cushions, price)
            if bent is not None and merit - _merit(bent, price) > gained:
                there, gained = bent, merit - _merit(bent, price)
        if gained < POOR * promised:
            radius *= 0.4
        elif gained > GOOD * promised:
            radius = min(2.0 * radius, LARGEST_RADIUS)
        if gained > 0.0:
            here, merit, model = there, _merit(there, price), None
        lacks.append(here.lack)
        if round_ >= SETTLED and merit - PATIENCE * max(promised, gained) > beat:
            return here, round_ + 1
        if promised <= WORTH * max(merit, 1e-9) or any(nearby(here.points, k.points, SAME_BASIN) for k in known):
            return here, round_ + 1
    return here, ROUNDS


def _bent(
    scene: Scene,
    here: Look,
    there: Look,
    model: Quadratic,
    step: Step,
    bounds: tuple[Floats, Floats],
    cushions: dict[PairClass, float],
    price: float,
) -> Look | None:
    """Where a step leads that heeds how the rows bend: with rows made where the straight one ended.

    The second-order correction of R. Fletcher, Practical Methods of Optimization, 1987, section 14.4: without it rows
    that bend make every step short that goes along them.
    """
    rows = there.rows
    seen_from_here = replace(rows, values=rows.values - rows.gradients @ step.step)
    _, moved, _ = _step(scene, here, model, seen_from_here, bounds, price)
    return None if moved is None else look(scene, Unknowns.of(scene.cell), moved, cushions)


def _step(
    scene: Scene, here: Look, model: Quadratic, rows: LinearRows, bounds: tuple[Floats, Floats], price: float
) -> tuple[Step | None, tuple[ArmPoint, ...] | None, bool]:
    """The best step and where it leads; None where some arm does not reach its task there.

    A step that ends beyond the end of reach, which bends, is made anew with so much more of it left; False for such.
    """
    unknowns = Unknowns.of(scene.cell)
    for count in range(NEARER + 1):
        step = best_step(model, rows, *bounds, price)
        if step is None:
            break
        moved, missing = move(scene.cell, here.points, here.along, unknowns, step.step)
        if missing == 0.0:
            return step, moved, count == 0
        if np.isinf(missing) or not np.any(rows.reach):
            break
        rows = rows.nearer(BEYOND * missing)
    return step, None, False


def _reach(cell: Cell, points: Sequence[ArmPoint], unknowns: Unknowns, radius: float) -> tuple[Floats, Floats]:
    """(C,) bounds of a step: the trust region, and the base regions."""
    lower, upper = np.full(unknowns.count, -SPARE * radius), np.full(unknowns.count, SPARE * radius)
    for a, (arm, point) in enumerate(zip(cell.arms, points, strict=True)):
        own, region = unknowns.base(a), arm.base.bounds
        if arm.base.yaw_free:
            region[3] = -np.inf, np.inf
        place = np.array([*point.position, point.yaw])
        reach = np.array([radius] * 3 + [TURN * radius])
        lower[own] = np.maximum(-reach, np.minimum(region[:, 0] - place, 0.0))
        upper[own] = np.minimum(reach, np.maximum(region[:, 1] - place, 0.0))
    return lower, upper


def _stuck(lacks: Sequence[float]) -> bool:
    """True where something is violated and that gets no better any more."""
    rounds, share = STUCK
    return lacks[-1] > CUSHION and len(lacks) > rounds and lacks[-1] > (1.0 - share) * lacks[-1 - rounds]


def _merit(at: Look, price: float) -> float:
    return at.objective + price * max(at.lack, 0.0)
