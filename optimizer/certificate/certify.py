"""Proof of global optimality for one uncoupled arm: branch and bound over base positions and postures.

The reduced problem (`duocell.optimizer.reduction.reduced`) is a search over x, y and perhaps z, once for each posture.
Boxes of base positions are bounded from below (`duocell.optimizer.certificate.bounds`), cut in two where the bound is
not good enough, and forgotten where it is. What remains true at any time: no path of the arm scores less than the
smallest bound among the boxes that are open and those that were forgotten. If no box is left at all, the task is
impossible.

Bounds close quadratically where postures are regular and with the square root of the size where the elbow is straight.
Where the wrist is singular, joints that hang together are bounded together (`bounds.together`, `angles.twist`). They do
not close at a pose exactly on axis 1 of an arm without shoulder offset: there one joint is free and drags others along,
which the bound does not follow. Where such a place could be best, the proof ends at its limit with the gap it has.

For a cell whose arms are coupled, the sum of these bounds is still a bound.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.base.kept import KEPT
from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.certificate.bounds.box_bounds import BoxBounder, BoxBounds
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.bounds.infeasibility_causes import CauseShares
from duocell.optimizer.certificate.bounds.region import MARGIN, THIN, reachable_region
from duocell.optimizer.certificate.exclusion.conditioning import poorly_conditioned
from duocell.optimizer.monitoring.events import Bounded
from duocell.optimizer.monitoring.watch import check_stop, tell
from duocell.optimizer.reduction.reduced import ReducedProblem, conditioning_shortfall, evaluate_signed
from duocell.optimizer.results.proof import ArmProof, Incumbent
from duocell.optimizer.settings import CertificateSettings

USABLE = 1e-9
"""Violation (m and rad) up to which a path counts as usable: the tolerance of limits everywhere."""
ROUNDING = 1e-7
"""Relative slack of the bound that is reported: constants of catalogue robots are known to about as much."""
FIRST_BOXES = 100
"""Boxes per posture to begin with."""
SMALLEST_FIRST = 0.05
"""Side of the boxes to begin with, relative to the reach: no smaller than this."""
SMALLEST, FINEST_CHECKED = 1e-8, 1.01 * KEPT
"""m; boxes with no longer half side are not cut any more, whatever their bound; and while what a check lets pass is not
excluded, which widens every box by more than that."""
ROWS = 12_000
"""Poses times boxes bounded at once: few enough to stay in the processor's cache."""
FEWEST = 64
"""Boxes bounded at once in long tasks."""
ROOM = 0.1
"""Of the room left for another arm: the half side of boxes that are not cut any more. Their bound hardly rises."""
EASY, AT_ONCE = 4000, 256
"""Boxes that most proofs need, and how many are cut at once after them. Many at once are cheap, but they are not the
most promising ones: where what would end a proof is not known yet, they are bounded in vain, by the ten thousands."""
CANDIDATES = 12
"""Places tried for a better incumbent per round."""

Progress = Callable[[float, float | None, int], None]
"""Called after every round with the lower bound, the best objective known (or None) and the boxes bounded so far."""


def certify(
    problem: ReducedProblem,
    incumbent: float | None,
    settings: CertificateSettings,
    stop: Callable[[], bool] | None = None,
    progress: Progress | None = None,
    tree: BranchAndBound | None = None,
) -> ArmProof:
    """Bound one arm's objective from below over its whole base region, all admitted postures, yaws and windings.

    Where something else than joint availability is asked for, it is joint availability that is bounded and minimised
    all the same: then only a proof that there is no path is of use, or a path where none was known.

    Args:
        problem: the arm's reduced problem on the full task.
        incumbent: objective of a usable path, if one is known (of the arm that is asked about, see
            `ReducedProblem.apart`).
        settings: relative gap to reach, time limit and number of boxes.
        stop: asked after every round; True ends the proof early.
        progress: told after every round.
        tree: of an earlier proof of the same problem with a gap no larger, to go on with; its boxes count.

    Returns:
        The proof as far as it got.

    Raises:
        Cancelled: whoever watches (`duocell.optimizer.monitoring.watch`) wants an end.
    """
    if tree is None:
        search = BranchAndBound(problem, incumbent, settings)
    else:
        search = tree
        search.go_on(incumbent, settings)
    while search.open and search.left > 0 and time.perf_counter() < search.deadline and not (stop and stop()):
        check_stop()
        search.round()
        tell(search.event())
        if progress:
            progress(search.lower_bound, search.objective, search.boxes)
    return search.proof()


class BranchAndBound:
    """The state of the branch and bound."""

    def __init__(self, problem: ReducedProblem, incumbent: float | None, settings: CertificateSettings) -> None:
        self.started = time.perf_counter()
        self.deadline = self.started + settings.time_limit
        problem = problem.for_bounds()
        self.problem, self.settings, self.given = problem, settings, incumbent
        self.stands_for_another = not problem.apart.negligible
        self.found: Incumbent | None = None
        self.boxes = 0
        self.forgotten = np.inf  # smallest bound of the boxes that are not cut any more
        self.lenient = incumbent is None  # what a check lets pass is not impossible
        self.bounder = BoxBounder.of(problem, checks=self.lenient)
        sides = problem.arm.base.bounds[:3]
        region = reachable_region(self.bounder.kinematics.targets, sides + self.lenient * MARGIN)
        self.cause_shares = CauseShares(problem, region)
        extents = np.maximum(region.high - region.low, 0.0)
        sizes = extents[extents > THIN]
        side = max((np.prod(sizes) / FIRST_BOXES) ** (1.0 / max(len(sizes), 1)), SMALLEST_FIRST * region.reach)
        self.fresh = Boxes.grid(region.low, region.high, side, problem.postures & (not region.empty))
        self.kept, self.bounds = self.fresh[:0], np.zeros(0)
        self.inherited = np.zeros(len(self.fresh))

    def go_on(self, incumbent: float | None, settings: CertificateSettings) -> None:
        """Take up again with what is known by now, and other limits.

        Raises:
            ValueError: the gap is smaller than before. Boxes that were good enough for the old one are gone.
        """
        if settings.gap < self.settings.gap:
            raise ValueError(f"boxes within a gap of {self.settings.gap:g} are gone, {settings.gap:g} is asked for")
        self.started = time.perf_counter()
        self.deadline = self.started + settings.time_limit
        self.settings, self.given, self.found = settings, incumbent, None

    def _sharpen(self) -> None:
        """Once something is known, costs from inside the region are of interest, not what just passes a check."""
        if not self.lenient or self.objective is None:
            return
        sides = self.problem.arm.base.bounds[:3]
        self.lenient, self.bounder = False, BoxBounder.of(self.problem)
        tiny = np.max(self.kept.half, axis=1, initial=0.0) <= THIN  # for which the difference counts
        again = Boxes.joined([self.fresh, self.kept[tiny]]), np.concatenate([self.inherited, self.bounds[tiny]])
        self.fresh, left = again[0].within(sides)
        self.inherited = again[1][left]
        self.kept, left = self.kept[~tiny].within(sides)
        self.bounds = self.bounds[~tiny][left]

    @property
    def open(self) -> bool:
        """True while some box may hold something better than what is known."""
        return len(self.fresh) + len(self.kept) > 0

    @property
    def left(self) -> float:
        """Boxes that may still be bounded."""
        return np.inf if self.settings.boxes is None else self.settings.boxes - self.boxes

    @property
    def objective(self) -> float | None:
        """The best objective known. What is found on this arm says nothing about another one that it stands for."""
        return self.given if self.stands_for_another else self.met

    @property
    def met(self) -> float | None:
        """The best objective known or found."""
        found = None if self.found is None else self.found.objective
        known = [value for value in (self.given, found) if value is not None]
        return min(known, default=None)

    @property
    def smallest(self) -> float:
        """m, half side of boxes that are not cut any more."""
        finest = FINEST_CHECKED if self.lenient else SMALLEST
        return max(finest, ROOM * self.problem.apart.wrist) if self.stands_for_another else finest

    @property
    def cutoff(self) -> float:
        """Boxes whose bound reaches this are good enough."""
        best = self.objective
        return np.inf if best is None else (best - self.settings.gap * max(best, 1e-9)) * (1.0 + 2.0 * ROUNDING)

    @property
    def lower_bound(self) -> float:
        """No path scores less; inf if there is none."""
        bounds = np.concatenate([self.bounds, self.inherited, [self.forgotten]])
        lowest = float(np.min(bounds))
        return lowest if np.isinf(lowest) else lowest * (1.0 - ROUNDING)

    def event(self) -> Bounded:
        """How far the proof has got."""
        bound, best = self.lower_bound, self.objective
        lower = None if np.isinf(bound) else min(bound, np.inf if best is None else best)
        gap = None if lower is None or best is None else (best - lower) / max(best, 1e-9)
        return Bounded(self.problem.arm.name, lower, best, gap, self.boxes)

    def round(self) -> None:
        """Bound some fresh boxes, look for a better incumbent among them, and choose whom to cut next."""
        self._sharpen()
        most = int(min(max(ROWS // len(self.problem.positions), FEWEST), self.left))
        now, later = self.fresh[:most], self.fresh[most:]
        found = self.bounder.bounds(now, self.cutoff)
        bounds = np.maximum(found.lower, self.inherited[:most])
        self._exclude(now, bounds)
        self.boxes += len(now)
        self.cause_shares.add(now, found)
        self._improve(now, found)
        self.kept, self.bounds = Boxes.joined([self.kept, now]), np.concatenate([self.bounds, bounds])
        self.fresh, self.inherited = later, self.inherited[most:]
        self._sharpen()
        done = (self.bounds >= self.cutoff) | (np.max(self.kept.half, axis=1, initial=0.0) <= self.smallest)
        self.forgotten = min(self.forgotten, float(np.min(self.bounds[done], initial=np.inf)))
        self.kept, self.bounds = self.kept[~done], self.bounds[~done]
        if not len(self.fresh) and len(self.kept):
            self._branch(most)

    def _exclude(self, boxes: Boxes, bounds: Floats) -> None:
        """Make bounds (N,) infinite where the smallest conditioning is kept nowhere in a box."""
        left = np.flatnonzero(bounds < self.cutoff)
        if self.problem.arm.min_conditioning is None or not len(left):
            return
        poor = poorly_conditioned(self.problem, self.bounder.kinematics, boxes[left])
        lost = np.any(poor, axis=1)
        bounds[left[lost]] = np.inf
        self.cause_shares.add_poor(boxes[left[lost]], poor[lost])

    def _branch(self, most: int) -> None:
        """Cut the boxes with the smallest bounds: in two, or in more while there are few."""
        most = most if self.boxes < EASY else min(most, AT_ONCE)
        count = min(most, len(self.kept))
        chosen = np.zeros(len(self.kept), dtype=bool)
        chosen[np.argpartition(self.bounds, count - 1)[:count]] = True
        self.fresh, self.inherited = self.kept[chosen].halved(), np.tile(self.bounds[chosen], 2)
        if len(self.fresh) <= most // 8:
            self.fresh, self.inherited = self.fresh.halved(), np.tile(self.inherited, 2)
        self.kept, self.bounds = self.kept[~chosen], self.bounds[~chosen]

    def _improve(self, boxes: Boxes, found: BoxBounds) -> None:
        """Evaluate the most promising places exactly."""
        order = np.argsort(np.where(found.lower < self.cutoff, found.expected, np.inf))[:CANDIDATES]
        order = order[np.isfinite(found.expected[order])]
        if len(order):
            self._evaluate(found.promising[order], boxes.posture[order])
            if self.problem.arm.min_conditioning is not None:  # what is cheapest may be what is not kept
                self._evaluate(boxes.centre[order], boxes.posture[order])

    def _evaluate(self, places: Floats, postures: Ints) -> None:
        """Keep the best of some places (n, 3) in postures (n,), if it is better than what was known."""
        signs, sides = np.array(ALL_SIGNS)[postures], self.problem.arm.base.bounds[:3]
        places = np.clip(places, sides[:, 0], sides[:, 1])
        paths = evaluate_signed(self.problem, places, signs)
        objective = np.where(paths.violation[0] <= USABLE, paths.objective[0], np.inf)
        known = np.inf if self.met is None else self.met
        for k in np.argsort(objective):
            if objective[k] >= known:
                return
            if self._well_conditioned(paths.joints[:, 0, k]):
                yaw, best = float(paths.yaw[0, k]), float(objective[k])
                self.found = Incumbent(places[k], ALL_SIGNS[postures[k]], yaw, best)
                return

    def _well_conditioned(self, joints: Floats) -> bool:
        """True if the path (6, m) keeps the limit on conditioning, where there is one."""
        if self.problem.arm.min_conditioning is None:
            return True
        return bool(conditioning_shortfall(self.problem, joints[:, None])[0] <= 0.0)

    def proof(self) -> ArmProof:
        """What has been shown."""
        lowest, best = self.lower_bound, self.objective
        infeasible = bool(np.isinf(lowest)) and best is None
        note = ""
        if np.isinf(lowest) and best is not None:
            lowest, note = best, "every box was ruled out although a solution is known: it holds only within tolerances"
        bound = None if infeasible else min(lowest, np.inf if best is None else best)
        gap = None if bound is None or best is None else (best - bound) / max(best, 1e-9)
        return ArmProof(
            lower_bound=bound,
            objective=best,
            gap=gap,
            proved=not note and (infeasible or (gap is not None and gap <= self.settings.gap)),
            infeasible=infeasible,
            boxes=self.boxes,
            wall_time=time.perf_counter() - self.started,
            causes=self.cause_shares.causes(),
            found=self.found,
            note=note,
        )
