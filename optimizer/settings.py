"""What a caller may choose about the way a layout is found."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class CertificateSettings:
    """How hard to prove: stop at this relative gap or after this time [s]."""

    gap: float = 0.01
    time_limit: float = 10.0


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of `optimizer.optimize`.

    Attributes:
        seed: seed of every sampler; the answer is a function of cell and settings.
        time_limit: s, soft limit of the whole call; beyond it the best point so far is returned as ``feasible``.
        certificate: None for no proof.
        baselines: names of methods of the literature to run beside ("interior-penalty", ...).
    """

    seed: int = 0
    time_limit: float = 60.0
    certificate: CertificateSettings | None = None
    baselines: tuple[str, ...] = ()
