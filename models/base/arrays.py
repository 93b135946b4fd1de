"""Array types and the one rule for arrays in value objects: they are read-only."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


def frozen(values: ArrayLike, shape: tuple[int | None, ...] | None = None) -> Floats:
    """A read-only float64 copy of ``values``.

    Args:
        values: anything array-like.
        shape: expected shape; ``None`` entries are free. Programming errors only, input is checked before.

    Raises:
        ValueError: the shape differs.
    """
    array: Floats = np.array(values, dtype=np.float64)
    if shape is not None and (
        array.ndim != len(shape) or any(want not in (None, have) for want, have in zip(shape, array.shape, strict=True))
    ):
        raise ValueError(f"expected shape {shape}, got {array.shape}")
    array.setflags(write=False)
    return array


def set_frozen(instance: object, name: str, values: Any, shape: tuple[int | None, ...]) -> None:
    """Replace field ``name`` of a frozen dataclass by a checked read-only array (for ``__post_init__``)."""
    object.__setattr__(instance, name, frozen(values, shape))
