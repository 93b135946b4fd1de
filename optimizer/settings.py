"""What a caller may choose about the way a layout is found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from duocell.optimizer.parameters.search import SEARCH, SearchParameters


@dataclass(frozen=True, slots=True)
class CertificateSettings:
    """How hard to prove.

    Attributes:
        gap: relative gap at which a proof stops.
        time_limit: s after which it is cut.
        boxes: boxes after which it stops, over all trees of the cell together; None: as many as it takes. Other than
            the time, this does not depend on how busy the machine is.
    """

    gap: float = 0.01
    time_limit: float = 10.0
    boxes: int | None = None


@dataclass(frozen=True, slots=True)
class ToleranceSettings:
    """Installation errors to look at: up to ``position`` m and ``angle`` rad for every base."""

    position: float = 2e-3
    angle: float = 1.75e-3  # a tenth of a degree


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of `duocell.optimizer.optimize`.

    Attributes:
        seed: seed of every sampler; the answer is a function of cell and settings.
        time_limit: s, soft limit of search, automatic proof and checks; the best that is known then is the answer.
        certificate: how hard to prove, within a time limit of its own that comes on top; "auto": as hard as is
            proportionate to the search (`duocell.optimizer.budget`); None: not at all.
        baselines: names of methods of the literature to run beside ("interior-penalty", ...).
        alternatives: how many other layouts to report at most.
        tolerance: installation errors to look at; None for none.
        explain: find out what blocks a cell without a layout; takes up to ``time_limit`` again.
        parameters: numbers of the search, for those who study it; other ones make another search.
    """

    seed: int = 0
    time_limit: float = 60.0
    certificate: CertificateSettings | Literal["auto"] | None = "auto"
    baselines: tuple[str, ...] = ()
    alternatives: int = 0
    tolerance: ToleranceSettings | None = None
    explain: bool = False
    parameters: SearchParameters = SEARCH
