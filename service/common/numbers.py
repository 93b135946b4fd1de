"""Numbers as JSON can hold them."""

from __future__ import annotations

from math import isfinite


def finite(value: float | None) -> float | None:
    """The number, or None where there is none or it is infinite (no limit, no margin)."""
    return float(value) if value is not None and isfinite(value) else None
