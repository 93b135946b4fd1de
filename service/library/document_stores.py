"""Whose documents are where: a folder for everybody, and one for each API key, whose names are its own.

Two keys may give the same name to different things. Whoever names one means their own first, then everybody's.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from duocell.service.library.document_store import DocumentStore

KEYS = ".keys"
"""Folder with the folders of the keys; no document is called like that."""


@dataclass(frozen=True, slots=True)
class View:
    """Who looks at what was brought.

    Attributes:
        data_dir: the service's folder.
        owner: name of the API key; "" where none is in use.
        everything: whether that of all keys is seen.
    """

    data_dir: Path
    owner: str = ""
    everything: bool = True

    @property
    def brings_for(self) -> str:
        """Whose is what this one brings; "" means everybody's, as is all that is brought while everything is shared."""
        return "" if self.everything else self.owner


class DocumentStores:
    """One kind of document in a folder: everybody's in the folder itself, those of keys below."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._known: dict[Path, DocumentStore] = {}

    def of(self, owner: str) -> DocumentStore:
        """That of a key; "": everybody's."""
        if not owner:
            return self._store(self._folder)
        digest = hashlib.sha256(owner.encode()).hexdigest()[:8]  # names may differ in the case of their letters alone
        return self._store(self._folder / KEYS / f"{owner}-{digest}")

    def seen_by(self, view: View) -> list[DocumentStore]:
        """Those that someone sees, in the order in which names are looked up."""
        first = [self.of(view.owner)] if view.owner else []
        return [*first, self.of(""), *(one for one in self._of_keys() if view.everything and one not in first)]

    def forget(self, age: float) -> None:
        """See `DocumentStore.forget`; for all of them."""
        for store in [self.of(""), *self._of_keys()]:
            store.forget(age)

    def _of_keys(self) -> list[DocumentStore]:
        return [self._store(folder) for folder in sorted((self._folder / KEYS).glob("*")) if folder.is_dir()]

    def _store(self, folder: Path) -> DocumentStore:
        return self._known.setdefault(folder, DocumentStore(folder))
