"""Who goes first where processors are scarce: the server, for it answers everybody."""

from __future__ import annotations

import os

READING = 5
"""Niceness (POSIX) of what reads requests: where a processor is shared it gets a third of what the server gets."""


def give_way(niceness: int) -> None:
    """Let this process wait for those of a lower niceness; never undone."""
    if os.getpriority(os.PRIO_PROCESS, 0) < niceness:
        os.setpriority(os.PRIO_PROCESS, 0, niceness)
