"""Layouts proposed by pairs of boxes that are open: the tree of a proof is a global search as well."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from duocell.models.base.arrays import Ints
from duocell.models.robot.arm import TURN
from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.certificate.arm_tree import AloneLayout, ArmTree
from duocell.optimizer.certificate.pairs.ties import mirrored_yaws
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.progress.incumbents import layout_found
from duocell.optimizer.reduction.reduced import ReducedProblem, evaluate_signed
from duocell.optimizer.sqp.nearby import nearby
from duocell.optimizer.sqp.refine import Refined, refine
from duocell.optimizer.verification.scene import Scene

BEST, RANDOM = 6, 6
"""Pairs of a round whose centres are tried: those with the smallest bounds, and others."""
TURNS = np.array(sorted((0.06 * k for k in range(-8, 9)), key=abs))
"""rad that a base is turned by where its best yaw collides."""
WORTH = 1e-4
"""Relative; starts that promise less than this are not refined."""
NEARLY = 5e-3
"""m or rad of violation that a start may have: refinements mend that."""
TIED = 0.05
"""m or rad of violation of ties that a start may have: refinements move bases onto them."""
BESIDE = 0.03
"""m; starts this near to one that was refined already lead to the same layout."""
IN_VAIN = 6
"""Refinements in a row that led to nothing better, after which no more are tried."""


@dataclass(eq=False, slots=True)
class Proposals:
    """Tries layouts in the centres of pairs of boxes.

    Attributes:
        scene: the cell. trees: of its arms. known: layouts that are clean, best first.
        centres: nearly usable layout of an arm in the centre of a box, by arm and number; None where there is none.
        tried: starts that were refined. in_vain: of these, the last ones in a row that led to nothing better.
        looks: rounds of pairs since one led to something better.
        rng: source of chance, seeded. deadline: `time.perf_counter` value, soft.
    """

    scene: Scene
    trees: Sequence[ArmTree]
    known: list[Refined]
    deadline: float
    centres: dict[tuple[int, int], AloneLayout | None] = field(default_factory=dict)
    tried: list[Sequence[ArmSolution]] = field(default_factory=list)
    in_vain: int = 0
    looks: int = 0
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))

    @property
    def objective(self) -> float:
        """Of the best layout that is known."""
        return self.known[0].objective if self.known else np.inf

    def look_alone(self) -> bool:
        """Try what all arms do best by themselves; True if that led to something better."""
        found = [tree.alone for tree in self.trees]
        layouts = [one for one in found if one is not None]
        if len(layouts) < len(found) or sum(one.objective for one in layouts) >= self.objective * (1.0 - WORTH):
            return False
        points = [one.point for one in layouts]
        return self.in_vain < IN_VAIN and self._nearly_clean(points) and self.refine(points)

    def look(self, first: Ints, second: Ints) -> bool:
        """Try some of the pairs (P,), best first; True if something better was found."""
        if not len(first) or self.in_vain >= IN_VAIN or not self._worth_a_look():
            return False
        better = False
        for k in [*range(min(BEST, len(first))), *self.rng.integers(len(first), size=RANDOM)]:
            start = self._start(int(first[k]), int(second[k]))
            if start is None or time.perf_counter() > self.deadline or self.in_vain >= IN_VAIN:
                continue
            better |= self.refine(start)
        if better:
            self.looks = 0
        return better

    def _worth_a_look(self) -> bool:
        """True ever more rarely once a layout is known and looks find nothing better: they cost more than pairs do."""
        self.looks += 1
        return not self.known or self.looks & (self.looks - 1) == 0

    def _start(self, first: int, second: int) -> list[ArmSolution] | None:
        """A layout in the centres of two boxes that is nearly clean and better than what is known."""
        totals = mirrored_yaws(self.scene.cell.couplings, (0, 1))
        pair = self._mirrored(first, second, totals[0]) if totals else (self._centre(0, first), self._centre(1, second))
        one, other = pair
        if one is None or other is None or one.objective + other.objective >= self.objective * (1.0 - WORTH):
            return None
        points = [one.point, other.point]
        return points if self._nearly_clean(points) else None

    def _mirrored(self, first: int, second: int, total: float) -> tuple[AloneLayout | None, AloneLayout | None]:
        """Layouts in the centres of two boxes whose yaws have a sum [rad, modulo 2π]: the dearer arm turns less."""
        centres = [_at_centre(tree, node) for tree, node in zip(self.trees, (first, second), strict=True)]
        if any(centre is None for centre in centres):
            return None, None
        one, other = (centre for centre in centres if centre is not None)
        off = total - one.point.yaw - other.point.yaw
        off -= TURN * round(off / TURN)
        weights = [tree.problem.arm.weights[0] * len(tree.problem.positions) for tree in self.trees]
        share = weights[1] / max(sum(weights), 1e-300)
        layouts = _turned_by(self.trees[0], one, share * off), _turned_by(self.trees[1], other, (1.0 - share) * off)
        if sum(layout.objective for layout in layouts) >= self.objective * (1.0 - WORTH):
            return None, None
        clean = [tree.check.nearly(layout.point, NEARLY) for tree, layout in zip(self.trees, layouts, strict=True)]
        return layouts if all(clean) else (None, None)

    def _nearly_clean(self, points: Sequence[ArmSolution]) -> bool:
        """True if refining a start may mend its violations, and none like it was refined already."""
        if any(nearby(points, tried, BESIDE) for tried in self.tried):
            return False
        if self.scene.tie_violation(points) > TIED or self.scene.floor_violation(points) > NEARLY:
            return False
        return bool(self.scene.contact_violations([points])[0] <= NEARLY)

    def refine(self, start: Sequence[ArmSolution]) -> bool:
        """Refine a start; True if that led to something better, which is then known."""
        self.tried.append(start)
        found = refine(self.scene, start, self.deadline, self.known)
        better = found.clean and found.objective < self.objective * (1.0 - WORTH)
        self.in_vain = 0 if better else self.in_vain + 1
        if better:
            self.known.insert(0, found)
            layout_found(found.points, found.objective, found.clearance)
        return better

    def _centre(self, arm: int, node: int) -> AloneLayout | None:
        """The cheapest layout of an arm in the centre of a box that is nearly usable."""
        if (arm, node) not in self.centres:
            self.centres[arm, node] = self._turned(self.trees[arm], node)
        return self.centres[arm, node]

    def _turned(self, tree: ArmTree, node: int) -> AloneLayout | None:
        centre = _at_centre(tree, node)
        if centre is None:
            return None
        turned = [_turned_by(tree, centre, float(turn)) for turn in TURNS]
        for layout in sorted(turned, key=lambda layout: layout.objective):
            if tree.check.nearly(layout.point, NEARLY):
                return layout
        return None


def _at_centre(tree: ArmTree, node: int) -> AloneLayout | None:
    """The layout of an arm in the centre of a box at its best yaw; None where limits or steps do not allow it."""
    boxes, problem = tree.nodes.boxes(np.array([node])), tree.problem
    paths = evaluate_signed(problem, boxes.centre, boxes.signs)
    if paths.violation[0, 0] > 0.0:
        return None
    joints = paths.joints[:, 0, 0].T
    point = ArmSolution(boxes.centre[0], float(paths.yaw[0, 0]), joints, ALL_SIGNS[boxes.posture[0]])
    return AloneLayout(point, float(paths.objective[0, 0]))


def _turned_by(tree: ArmTree, layout: AloneLayout, turn: float) -> AloneLayout:
    """A layout whose base is turned [rad], with its objective."""
    problem, point = tree.problem, moved_yaw(tree.problem, layout.point, turn)
    counts = np.ones(len(point.joints)) if problem.weights is None else problem.weights
    before, after = ((p.joints[:, 0] - problem.arm.reference[0]) ** 2 @ counts for p in (layout.point, point))
    return AloneLayout(point, float(layout.objective + problem.arm.weights[0] * (after - before)))


def moved_yaw(problem: ReducedProblem, point: ArmSolution, turn: float) -> ArmSolution:
    """The same layout of an arm on a base that is turned [rad]."""
    joints = point.joints.copy()
    joints[:, 0] -= problem.sigma * turn
    return ArmSolution(point.position, problem.arm.base.yaw_in_interval(point.yaw + turn), joints, point.signs)
