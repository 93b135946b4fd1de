"""What a trial is given, and what it finds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Setup:
    """Where a trial takes place.

    Attributes:
        folder: empty, of its own. postgres: URL of an empty database where the trial wants one, else None.
    """

    folder: Path
    postgres: str | None

    @property
    def settings(self) -> dict[str, str]:
        """Environment that names the database."""
        return {} if self.postgres is None else {"DUOCELL_DATABASE_URL": self.postgres}


@dataclass(frozen=True, slots=True)
class Finding:
    """What came out: whether the promise was kept, and figures."""

    kept: bool
    seen: str


@dataclass(frozen=True, slots=True)
class Trial:
    """A fault, the stores that it is tried on ("sqlite", "postgresql"), and what is promised."""

    name: str
    fault: str
    promise: str
    stores: tuple[str, ...]
    run: Callable[[Setup], Finding]
