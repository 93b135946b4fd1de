"""What a caller may choose about the way a layout is found."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class CertificateSettings:
    """How hard to prove: stop at this relative gap or after this time [s]."""

    gap: float = 0.01
    time_limit: float = 10.0


@dataclass(frozen=True, slots=True)
class ToleranceSettings:
    """Installation errors to look at: up to ``position`` m and ``angle`` rad for every base."""

    position: float = 2e-3
    angle: float = 1.75e-3  # a tenth of a degree


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of `optimizer.optimize`.

    Attributes:
        seed: seed of every sampler; the answer is a function of cell and settings.
        time_limit: s, soft limit of the whole call; beyond it the best point so far is returned as ``feasible``.
        certificate: None for no proof.
        baselines: names of methods of the literature to run beside ("interior-penalty", ...).
        alternatives: how many other layouts to report at most.
        tolerance: installation errors to look at; None for none.
        explain: find out what blocks a cell that turns out infeasible; takes up to ``time_limit`` again.
    """

    seed: int = 0
    time_limit: float = 60.0
    certificate: CertificateSettings | None = None
    baselines: tuple[str, ...] = ()
    alternatives: int = 0
    tolerance: ToleranceSettings | None = None
    explain: bool = False
