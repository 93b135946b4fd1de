"""What a solve tells whoever follows it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from duocell.models.base.arrays import Floats


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened; ``kind`` is its stable name."""

    kind: ClassVar[str]


@dataclass(frozen=True, slots=True)
class Stage(Event):
    """Something else is being done now.

    Attributes:
        what: words for a person, "searching main".
        done: share of the whole that lies behind, in [0, 1]; it never falls.
        remaining: s that it probably still takes, a guess; None where nobody guesses.
    """

    kind: ClassVar[str] = "stage"
    what: str
    done: float
    remaining: float | None = None


@dataclass(frozen=True, slots=True)
class Screened(Event):
    """A round of screening is over.

    Attributes:
        arm: its name. candidates: bases × postures looked at.
        usable: starts found that keep all limits. best: objective of the best of them, or None.
    """

    kind: ClassVar[str] = "screening"
    arm: str
    candidates: int
    usable: int
    best: float | None


@dataclass(frozen=True, slots=True)
class Started(Event):
    """A local solve has ended.

    Attributes:
        arm: its name, "" for all together. start: number of the solve, from 1. status: what it ended with.
        objective: there, or None without a usable point. iterations: of IPOPT.
    """

    kind: ClassVar[str] = "start"
    arm: str
    start: int
    status: str
    objective: float | None
    iterations: int


@dataclass(frozen=True, slots=True)
class Iterated(Event):
    """An iteration of the local solve under way is over: one of IPOPT, or a step of all arms together.

    Attributes:
        iteration: its number. objective: E there. violation: largest violation of a row (m, rad, ...).
    """

    kind: ClassVar[str] = "iteration"
    iteration: int
    objective: float
    violation: float


@dataclass(frozen=True, slots=True)
class Bounded(Event):
    """A round of branch and bound is over.

    Attributes:
        arm: its name. lower_bound: no layout scores less, None if none is left.
        objective: best one known, or None. gap: relative, or None. boxes: bounded so far.
    """

    kind: ClassVar[str] = "bound"
    arm: str
    lower_bound: float | None
    objective: float | None
    gap: float | None
    boxes: int


@dataclass(frozen=True, eq=False, slots=True)
class Standing:
    """Where one arm of a layout stands.

    Attributes:
        name: of the arm. position: m, base origin in the world. yaw: rad. posture: names of the signs, or None.
        objective: its part of E. mount: (3, 3) orientation of the base in the world at yaw 0.
    """

    name: str
    position: tuple[float, float, float]
    yaw: float
    posture: dict[str, str] | None
    objective: float
    mount: Floats


@dataclass(frozen=True, eq=False, slots=True)
class Incumbent(Event):
    """A usable layout of the whole cell, better than all before.

    Attributes:
        objective: E. time: s since the start. arms: where they stand, in the order of the cell.
    """

    kind: ClassVar[str] = "incumbent"
    objective: float
    time: float
    arms: tuple[Standing, ...]


@dataclass(frozen=True, slots=True)
class Verified(Event):
    """The answer has been checked by other numbers than those it was found with.

    Attributes:
        max_position_error: m. max_orientation_error: rad. limits_respected: of joints and regions.
    """

    kind: ClassVar[str] = "verification"
    max_position_error: float
    max_orientation_error: float
    limits_respected: bool
