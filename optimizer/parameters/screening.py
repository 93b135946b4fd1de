"""The numbers of the screening: how many bases of an arm are looked at, and which of them are improved."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ScreeningParameters:
    """What a round of `duocell.optimizer.reduction.screening` looks at and keeps.

    The cost of a round is about linear in ``points`` and in the poses they are looked at with; every later stage only
    sees what a round kept. No trial of these numbers one by one is on record; `docs/trials.md` has those of the whole
    search.

    Attributes:
        coarse_poses: poses that the points of the spread are looked at with. Few will do, because what is picked is
            improved on more; with a conditioning asked for ``careful_poses``, as the worst pose decides there.
        sampled_poses: poses of a long task that the best points are improved with; what comes out is checked on all.
        points: base positions of the first round, by number of free coordinates; each has eight postures.
        rounds: at most. A later round has four times the points of the one before, and is run only while nothing
            usable was found.
        valleys: followed per posture. neighbours: spacings within which points are neighbours.
        more_usable: usable points improved beside the valleys, which may lie outside the limits.
        cloud: points strewn around each of them; the cloud shrinks to half in each step.
        first_steps: with all candidates. last_steps: further ones, with the ``last`` best of them.
        of_a_posture: of these no more are of one posture while there are others.
        looked_at: points of the spread that are looked at on the whole of a long task, where paths may wind otherwise
            between the poses of a sample; last_of_whole: how many of them are improved too.
        singular_minima: of the cost to be looked into: millimetres wide, no spread of points meets them.
        singular_radius: m, how far from their bottoms.
        thinned: times as many points where a conditioning is asked for, which thins the usable set out.
        stricter: how many times a violation counts where the best usable point of a posture is improved all the same:
            what a conditioning rules out may cost half as much, and draws everything else away.
        conditioned: paths of a round whose conditioning is looked at, at ``conditioned_poses`` of their poses: singular
            values are expensive.
    """

    coarse_poses: int = 5
    careful_poses: int = 12
    sampled_poses: int = 32
    points: tuple[int, int, int, int] = (1, 64, 512, 1536)
    rounds: int = 4
    valleys: int = 8
    neighbours: float = 1.1
    more_usable: int = 3
    cloud: int = 10
    first_steps: int = 1
    last_steps: int = 4
    last: int = 10
    of_a_posture: int = 6
    looked_at: int = 128
    last_of_whole: int = 6
    singular_minima: int = 3
    singular_radius: float = 2e-3
    thinned: int = 2
    stricter: float = 100.0
    conditioned: int = 8192
    conditioned_poses: int = 5


SCREENING = ScreeningParameters()
