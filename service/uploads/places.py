"""Places for uploads: so many of each client and of all of them; who comes beyond that is told to come back.

There are places where a body arrives and others where it is read: whoever sends slowly, or stops, keeps nobody from
being read.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from duocell.service.common.problems import Problem
from duocell.service.settings import Limits

RETRY_AFTER = "5"


class Places:
    """Places of one kind; lives in the event loop.

    Args:
        of_one: places that one client may have. of_all: that all may have together.
        doing: what is done there, in the words of a refusal.
        settings: where the two numbers come from, likewise.
    """

    def __init__(self, of_one: int, of_all: int, doing: str, settings: tuple[str, str]) -> None:
        self._of_one, self._of_all = of_one, of_all
        self._doing, self._settings = doing, settings
        self._present: Counter[str] = Counter()

    def check(self, client: str) -> None:
        """Whether there is one for a client.

        Raises:
            Problem: there is none.
        """
        own, every = self._present[client], self._present.total()
        if own >= self._of_one:
            number, setting = f"{own} of your uploads", self._settings[0]
        elif every >= self._of_all:
            number, setting = f"{every} uploads", self._settings[1]
        else:
            return
        detail = f"{number} are {self._doing} already ({setting}). Try again soon."
        raise Problem("uploads-full", detail, headers={"Retry-After": RETRY_AFTER, "Connection": "close"})

    @contextmanager
    def taken(self, client: str) -> Iterator[None]:
        """One of a client, as long as the block.

        Raises:
            Problem: there is none.
        """
        self.check(client)
        self._present[client] += 1
        try:
            yield
        finally:
            self._present[client] -= 1
            if not self._present[client]:
                del self._present[client]  # addresses are many


@dataclass(frozen=True, slots=True)
class UploadPlaces:
    """Where uploads arrive, and where they are read or wait for it."""

    arriving: Places
    reading: Places


def upload_places(limits: Limits) -> UploadPlaces:
    """The places that the settings allow; the last where uploads are read is not for the client that has the rest."""
    arriving = ("DUOCELL_MAX_ARRIVING", "DUOCELL_MAX_ARRIVING_IN_ALL")
    reading = ("DUOCELL_MAX_UPLOADS", "DUOCELL_MAX_UPLOADS")
    most = limits.max_uploads
    return UploadPlaces(
        Places(limits.max_arriving, limits.max_arriving_in_all, "arriving", arriving),
        Places(max(1, most - 1), most, "being read", reading),
    )
