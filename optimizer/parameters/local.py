"""The numbers of the local solves of one arm: which candidates get one, and what is tried where none of them helps."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class LocalParameters:
    """Which starts of an arm are solved, and what follows (`duocell.optimizer.single_arm`).

    Attributes:
        starts: local solves of an arm with a reduced problem; twice as many where none of them ends in a usable point,
            half as many from ``long_task`` poses on, whose solves take long.
        worth: starts scored this many times the best usable one are not worth a solve: screening is precise to a few
            percent.
        moved: candidates that are improved on the whole task before that, within ``move`` of a spacing, in
            ``move_steps`` steps. usable_too: usable ones among them where the best ones are not usable.
        moved_of_a_posture: of them no more are of one posture while there are others, with a conditioning asked for.
        careful_steps: in which a candidate is improved where the local solver may be of no help.
        finished: candidates that are brought to their optimum on the reduced problem alone. closer: shares of the first
            radius that they start from.
        deeper: a singular minimum may be this many times as deep as what is seen of it.
        decide_worth: s, counted in boxes, that the branch and bound may take that decides whether a task is possible
            for which no usable candidate was met; decide_gap: relative, at which it ends.
        early_worth, early_pose: s, and s per pose, that it is worth before local solves, which take longer and may lead
            nowhere. early_poses: most poses of a task for which it can tell anything so soon.
        share: of the time left that one local solve may take: a start that struggles must not use up the others' time.
        solve_pose: s per pose that a solve may take all the same, many times what it needs: time must not decide where
            there is enough of it.
        half_step: share of a joint step that half the path to the next pose may take in a search with the middles
            between the poses; most_finer: poses of such a search at most.
        box_worth, box_gap: s, counted in boxes, and relative gap of the boxes that are looked at after local solves,
            where slivers of the allowed bases may hold something better. near: m about their find that is looked at.
        costlier: relative; where the best optimum cannot be followed between the poses, and what can be costs so much
            more, more optima are tried. other_draws: what is added to the seed of the draws then.
    """

    starts: int = 8
    long_task: int = 200
    worth: float = 1.2
    moved: int = 6
    move: float = 0.25
    move_steps: int = 3
    usable_too: int = 2
    moved_of_a_posture: int = 4
    careful_steps: int = 10
    finished: int = 3
    closer: tuple[float, ...] = (1.0, 0.2, 0.04)
    deeper: float = 1.05
    decide_worth: float = 5.0
    decide_gap: float = 1e-3
    early_worth: float = 0.1
    early_pose: float = 2e-3
    early_poses: int = 512
    share: float = 0.5
    solve_pose: float = 0.05
    half_step: float = 0.55
    most_finer: int = 400
    box_worth: float = 1.5
    box_gap: float = 1e-3
    near: float = 0.01
    costlier: float = 1e-3
    other_draws: int = 100


LOCAL = LocalParameters()
