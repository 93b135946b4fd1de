"""The numbers of the search of a coupled cell: how many layouts are sampled, and which of them are refined."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Pairing:
    """How far pairs of placements are looked through.

    Attributes:
        wanted: layouts that violate nothing after which no more are looked for.
        windows: where arms share no tied unknown, so many of the cheapest placements of each are paired, then of more
            and more.
        block: pairs looked at together.
        worth: once a clean layout is known, what costs this many times the cheapest of them is left out.
    """

    wanted: int
    windows: tuple[int, ...]
    block: int
    worth: float = 1.5


@dataclass(frozen=True, slots=True)
class CoupledParameters:
    """How much a coupled cell is sampled, and what is made of it (`duocell.optimizer.coupled`).

    Attributes:
        positions: base positions of a round of density 1, by number of free coordinates of an arm; each has eight
            postures.
        densities: samples of each round, relative to ``positions``: the first is to find a usable layout early, the
            last is for cells in which the second finds none, and takes only what can be followed between the poses.
        quick, full: how far the first and the later rounds look pairs through. In the first any usable layout will do.
        apart: m; layouts of the same postures whose bases are all nearer than this count as one start.
        measured: layouts of a round that Coal measures at most.
        clean, others: starts of a round that keep everything at the poses, and others. few: clean ones that are
            measured first where any usable layout will do.
        rounds: of arms without a reduced problem, whose candidates are few and looked at closely.
        short: poses that stand for a long task, at first and where nothing is found with these. From ``long`` poses on
            a task is long.
        tried: of the clean starts, so many are checked as they are for a first usable layout.
        idle: how many refinements in a row may lead to nothing better than a clean layout that is known, where no
            alternatives are asked for (decision 25).
        worth: starts whose score is this many times the best clean layout are not worth a refinement.
        beside: m; a start this near to a better layout in the same postures is not worth a refinement either.
        hopeless: m; what violates more at its poses needs no look between them.
        alternatives_apart: m; starts this near to what is known in the same postures are no alternatives.
        elsewhere: refinements per alternative, twice. other_starts: that do not keep everything, of every look for
            them.
        precise: relative fall of the merit at which the answer's last descent ends; again: so often at most, while
            that gains more than the share ``still``: along the end of reach descents take many short steps.
        rivals: relative; layouts that cost no more than this above the best one are brought to their optima as well.
    """

    positions: tuple[int, int, int, int] = (1, 200, 1500, 3000)
    densities: tuple[float, ...] = (0.15, 1.0, 4.0)
    quick: Pairing = Pairing(8, (16, 48, 192, 768, 2048), 256)
    full: Pairing = Pairing(48, (48, 192, 768, 2048), 2048)
    apart: float = 0.12
    measured: int = 160
    clean: int = 10
    others: int = 6
    few: int = 3
    rounds: int = 2
    short: tuple[int, ...] = (40, 160)
    long: int = 60
    tried: int = 6
    idle: int = 4
    worth: float = 1.25
    beside: float = 0.06
    hopeless: float = 5e-3
    alternatives_apart: float = 0.3
    elsewhere: int = 6
    other_starts: int = 6
    precise: float = 1e-9
    again: int = 6
    still: float = 1e-7
    rivals: float = 1e-3


COUPLED = CoupledParameters()
