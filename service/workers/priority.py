"""Who goes first where processors are scarce: the server, for it answers everybody."""

from __future__ import annotations

import os

READING = 5
"""Niceness (POSIX) of what somebody waits for: it gets a third of what the server gets."""
IMPORTING = 10
"""Niceness of what takes long in any case."""


def give_way(niceness: int) -> None:
    """Let this process wait for those of a lower niceness; never undone."""
    if os.getpriority(os.PRIO_PROCESS, 0) < niceness:
        os.setpriority(os.PRIO_PROCESS, 0, niceness)
