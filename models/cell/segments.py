"""Where the segments of a task begin and end, by index."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from duocell.models.base.arrays import Bools


def slices(starts: Sequence[int], count: int) -> tuple[slice, ...]:
    """Segments of ``count`` poses altogether that begin at ``starts``."""
    return tuple(slice(a, b) for a, b in zip(starts, (*starts[1:], count), strict=True))


def joined(starts: Sequence[int], count: int) -> Bools:
    """(count - 1,) True where the next pose is one of the same segment."""
    same: Bools = np.ones(max(count - 1, 0), dtype=np.bool_)
    same[np.array(starts[1:], dtype=np.int64) - 1] = False
    return same
