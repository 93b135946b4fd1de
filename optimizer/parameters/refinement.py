"""The numbers of the sequential quadratic programming: trust region, penalties, and when a descent has ended."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RefinementParameters:
    """How `duocell.optimizer.sqp` refines a layout.

    Attributes:
        rounds: programs that one descent may solve.
        radius: m that a base may move in a round along each axis, at first; smallest_radius: before giving up;
            largest_radius: at most.
        turn: rad per m of that radius that a base may turn. nullspace: and that a joint may move by self-motion.
        stuck: rounds over which the violation of a layout that still has one must fall by a share, and that share.
        poor, good: share of the promised fall below which the radius shrinks, above which it grows.
        shorter, short, longer: factors on the radius: after a step that led nowhere, one that kept little of its
            promise, one that kept it.
        nearer: how often a step that ends beyond an arm's reach is made anew; beyond: how many times what it missed is
            asked for then.
        margin: m asked for beyond the required distance, for what the linear rows leave out.
        patience: a descent that would need more than so many rounds like the one before it to beat what is known is
            given up, though not in its first ``settled`` rounds.
        same_basin: m; layouts in the same postures whose bases are nearer than this to each other lead to one optimum.
        worth: relative fall of the merit below which a round was the last one. Where the answer is to be precise it is
            1e-9 (`CoupledParameters.precise`).
        dips: how often a path that dips between its samples is sent back with more margin.
        farther: factor on the smallest conditioning of an arm that cannot follow the object; singular: what is asked
            for at least.
        penalty: of a metre or radian of violation, per pose and unit of weight; dearer: factor on it where that is too
            little to end a violation.
        safe: factor on the penalty at which a descent that lost a layout without violation is tried once more from
            there.
        nearly, hopeless: m or rad; what violates less is worth the full check, what violates more is given up.
    """

    rounds: int = 50
    radius: float = 0.1
    smallest_radius: float = 1e-5
    largest_radius: float = 0.4
    turn: float = 3.0
    nullspace: float = 3.0
    stuck: tuple[int, float] = (6, 0.1)
    poor: float = 0.25
    good: float = 0.75
    shorter: float = 0.3
    short: float = 0.4
    longer: float = 2.0
    nearer: int = 3
    beyond: float = 1.5
    margin: float = 1e-4
    patience: float = 20.0
    settled: int = 3
    same_basin: float = 0.01
    worth: float = 1e-5
    dips: int = 5
    farther: float = 2.0
    singular: float = 5e-3
    penalty: float = 100.0
    dearer: float = 10.0
    safe: float = 100.0
    nearly: float = 1e-3
    hopeless: float = 0.03


REFINEMENT = RefinementParameters()
