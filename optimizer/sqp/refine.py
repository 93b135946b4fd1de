"""From a start to the nearest best layout that keeps every distance: sequential quadratic programs.

Every iterate is a real layout: its arms are exactly on their tasks (`manifold`). Around it the objective is a quadratic
and all constraints are linear rows, renewed at every step; a trust region and one slack for all rows keep that honest
(`descent`). What the rows do not show is seen by the full check of the path at the foot of a descent, and asked for in
the next one.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import PairClass
from duocell.optimizer.clearance.clearance import PathClearance
from duocell.optimizer.nlp.measure import placed
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.parameters.refinement import REFINEMENT, RefinementParameters
from duocell.optimizer.sqp.descent import Terms, descend
from duocell.optimizer.sqp.dips import dips, followed_dips
from duocell.optimizer.sqp.linearisation import Linearisation
from duocell.optimizer.sqp.nearby import nearby
from duocell.optimizer.sqp.samples import sample_path
from duocell.optimizer.verification.scene import LIMITS, Scene


@dataclass(frozen=True, eq=False, slots=True)
class Refined:
    """Where a refinement ended.

    Attributes:
        points: one per arm. objective: E. violation: largest violation met at the samples, <= 0 if none.
        clean: True if the layout passed every check. clearance: the path check of a layout that is clean or nearly so.
        rounds: programs solved.
    """

    points: tuple[ArmSolution, ...]
    objective: float
    violation: float
    clean: bool
    clearance: PathClearance | None
    rounds: int


def penalty_of(cell: Cell, parameters: RefinementParameters = REFINEMENT) -> float:
    """Cost of a metre or radian of violation, in units of the objective."""
    scales = [cell.objective.scale(arm) for arm in cell.arms]
    return parameters.penalty * cell.task.total_weight * sum(scales) / len(scales)


def refine(
    scene: Scene,
    start: Sequence[ArmSolution],
    deadline: float,
    known: Sequence[Refined] = (),
    beat: float = np.inf,
    worth: float | None = None,
    parameters: RefinementParameters = REFINEMENT,
) -> Refined:
    """Improve a layout until it is clean and locally best, or no longer gets better.

    Args:
        scene: the cell. start: one point per arm, each on its task. deadline: `time.perf_counter` value, soft.
        known: where other starts ended; one that the way leads to is the answer, without going all of it.
        beat: E; a way that does not seem to lead to less is not gone to its end.
        worth: relative fall of the merit below which a round was the last one; None: that of the parameters.
        parameters: of the stage.
    """
    run = _Refinement(scene, tuple(start), deadline, beat, parameters)
    worth = parameters.worth if worth is None else worth
    for _ in range(parameters.dips + 1):
        here = run.descended(worth, [one.points for one in known])
        for other in known:
            if nearby(here.points, other.points, parameters.same_basin):
                return other
        if not run.goes_on_from(here):
            break
    return run.best or Refined(here.points, here.objective, here.violation, False, None, run.rounds)


@dataclass(eq=False, slots=True)
class _Refinement:
    """Descents one after the other, each of which asks for what the one before it missed.

    Beyond the end of reach there is no slope to go back by: there the way down is gone once more from the start.

    Attributes:
        scene: the cell. start: one point per arm. deadline, beat, parameters: see `refine`.
        best: the last layout that had its full check. rounds: programs solved.
    """

    scene: Scene
    start: tuple[ArmSolution, ...]
    deadline: float
    beat: float
    parameters: RefinementParameters
    best: Refined | None = None
    rounds: int = 0
    _asked: Scene = field(init=False)
    _margins: dict[PairClass, float] = field(init=False)
    _penalty: float = field(init=False)
    _points: tuple[ArmSolution, ...] = field(init=False)
    _safe: Linearisation | None = None  # kept all distances at the samples; the way down must not lose that for good

    def __post_init__(self) -> None:
        self._asked, self._points, self._penalty = self.scene, self.start, self._first_penalty
        self._margins = dict.fromkeys(PairClass, self.parameters.margin)

    @property
    def _first_penalty(self) -> float:
        return penalty_of(self.scene.cell, self.parameters)

    def descended(self, worth: float, ends: Sequence[Sequence[ArmSolution]]) -> Linearisation:
        """Where the next descent ends."""
        terms = Terms(self._asked, self._margins, self._penalty, worth, self.deadline, ends, self.beat, self.parameters)
        seen = terms.seen(self._points)
        if self._safe is None and self.best is None and seen.violation <= 0.0:
            self._safe = seen
        here, used = descend(terms, seen)
        self.rounds += used
        return here

    def goes_on_from(self, here: Linearisation) -> bool:
        """Get ready for another descent; False where there is none to be made."""
        if here.objective > self.beat:
            return False
        if self._is_lost(here):
            return self._is_safer()
        self._points = here.points
        if here.violation <= self.parameters.nearly:
            self.best = _judged(self.scene, here, self.rounds)
            if self.best.clean or time.perf_counter() > self.deadline:
                return False
            if self.best.clearance is not None:
                self._ask_for_more(self.best.clearance)
        self._penalty *= self.parameters.dearer
        return True

    def _is_lost(self, here: Linearisation) -> bool:
        """True where a violation is too large to be mended, or does not end although it got dearer."""
        dearer, parameters = self._penalty > self._first_penalty, self.parameters
        still = self.best is None and here.violation > parameters.nearly and dearer
        return here.violation > parameters.hopeless or still

    def _is_safer(self) -> bool:
        """Begin anew at the layout that violated nothing, with violations much dearer; False where that was done."""
        penalty = self.parameters.safe * self._first_penalty
        if self._safe is None or self.best is not None or self._penalty >= penalty:
            return False
        self._points, self._penalty = self._safe.points, penalty
        return True

    def _ask_for_more(self, clearance: PathClearance) -> None:
        """What the full check found missing between the samples."""
        for found in clearance.classes:
            if not found.clear:
                self._margins[found.kind] += 1.2 * (found.required - found.distance) + self.parameters.margin
        self._asked = _with_worst_limit(self._asked, clearance)
        closer = _with_breaks(self._asked, clearance, self._points)
        from_here = [points for points in (self._points, self.start) if closer and _is_followed(closer, points)]
        if closer is not None and from_here:
            self._asked, self._points = closer, from_here[0]
        else:
            self._asked = _away_from_singularities(self._asked, clearance, self._points, self.parameters)


def _judged(scene: Scene, here: Linearisation, rounds: int) -> Refined:
    """A layout that nearly holds everything, after the full check of its path."""
    clearance = scene.certify(here.points)
    violation = max(scene.tie_violation(here.points), scene.floor_violation(here.points))
    passes = clearance.clear and clearance.limit_excess <= LIMITS
    clean = violation <= LIMITS and scene.usable(here.points) and passes
    return Refined(
        here.points,
        here.objective,
        max(violation, here.violation if not clean else violation),
        clean,
        clearance,
        rounds,
    )


def _away_from_singularities(
    scene: Scene, clearance: PathClearance, points: Sequence[ArmSolution], parameters: RefinementParameters
) -> Scene:
    """The scene with arms that lose their way between two poses kept farther from singularities, where that happens."""
    lost = {one.arm for one in clearance.breaks}
    arms = []
    for arm, point in zip(scene.cell.arms, points, strict=True):
        if arm.name in lost:
            now = placed(scene.cell, arm, point).minimum_conditioning
            least = max(parameters.farther * now, parameters.singular, arm.min_conditioning or 0.0)
            arm = replace(arm, min_conditioning=least)
        arms.append(arm)
    return replace(scene, cell=replace(scene.cell, arms=tuple(arms)))


def _with_worst_limit(scene: Scene, clearance: PathClearance) -> Scene:
    """The scene with the place at which a joint leaves its limits between the samples for another sample."""
    worst = clearance.worst_limit
    if worst.amount <= LIMITS or not 0.0 < worst.fraction < 1.0:
        return scene
    return replace(scene, between=(*scene.between, (worst.pose, worst.fraction)))


def _with_breaks(scene: Scene, clearance: PathClearance, points: Sequence[ArmSolution]) -> Scene | None:
    """The scene with the places at which an arm lost its way for more samples; None where there is no new one."""
    between, known = set(scene.between), set(scene.dips)
    names = [arm.name for arm in scene.cell.arms]
    for lost in clearance.breaks:
        if 0.0 < lost.fraction < 1.0:
            index = names.index(lost.arm)
            bottoms = dips(scene, index, points[index], lost.pose)
            known |= {(index, lost.pose, fraction) for fraction in bottoms}
            between |= set() if bottoms else {(lost.pose, lost.fraction)}
    closer = replace(scene, between=tuple(sorted(between)), dips=tuple(sorted(known)))
    return closer if (closer.between, closer.dips) != (scene.between, scene.dips) else None


def _is_followed(scene: Scene, points: Sequence[ArmSolution]) -> bool:
    """True if a layout's arms follow the object at all places that are looked at."""
    between = (*scene.between, *followed_dips(scene, points))
    return sample_path(scene.cell, scene.path, scene.bases(points), points, between).followed
