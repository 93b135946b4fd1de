"""What the commands end with."""

from __future__ import annotations

from enum import IntEnum


class Exit(IntEnum):
    """Exit codes."""

    SOLVED = 0
    FAILED = 1
    BAD_INPUT = 2
    INFEASIBLE = 3
    CUT = 4
    UNKNOWN = 5
    INTERRUPTED = 130
