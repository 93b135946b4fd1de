"""API keys: made here, known to the service by their hashes only.

A key is 32 random bytes, so that a plain SHA-256 of it can neither be guessed nor looked up; salts and slow hashes are
for passwords, which people choose.
"""

from __future__ import annotations

import hashlib
import hmac
import logging
import re
import secrets
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from duocell.service.settings import Access

log = logging.getLogger(__name__)

LOOK_EVERY = 1.0
"""s between looks at the file with keys."""

PREFIX = "duocell_"
"""So that a key in the wrong place can be found by its looks."""

NAME = re.compile(r"[A-Za-z0-9._-]{1,64}")
_LINE = re.compile(rf"(?P<name>{NAME.pattern}):sha256:(?P<digest>[0-9a-f]{{64}})")
FORM = "NAME:sha256:64 hexadecimal digits, as `duocell key new NAME` prints it"


@dataclass(frozen=True, slots=True)
class ApiKey:
    """What is kept of a key: whose it is, and its SHA-256 (32 bytes)."""

    name: str
    digest: bytes


class KeysUnusable(Exception):
    """The configured keys cannot be used; the message says where, and never what stands there."""


class Keyring:
    """The keys that are accepted; with none of them every request is.

    Args:
        keys: at the beginning.
        reload: asked at most every `LOOK_EVERY` s whether there are others by now; None: there are not.
    """

    def __init__(
        self, keys: Iterable[ApiKey] = (), reload: Callable[[], tuple[ApiKey, ...] | None] | None = None
    ) -> None:
        self._keys = tuple(keys)
        self._closed = bool(self._keys)  # and stays so, also when the last key is taken back
        self._reload = reload
        self._looked = time.monotonic()

    def __bool__(self) -> bool:
        return self._closed

    def owner(self, presented: str) -> str | None:
        """Whose key this is, or None. The time it takes does not depend on how much of it is right."""
        self._look()
        digest, found = _digest(presented), None
        for key in self._keys:
            if hmac.compare_digest(key.digest, digest):
                found = key.name
        return found

    def _look(self) -> None:
        now = time.monotonic()
        if self._reload is not None and now - self._looked >= LOOK_EVERY:
            self._looked = now
            fresh = self._reload()
            self._keys = self._keys if fresh is None else fresh


class _KeysFile:
    """Reads the file with keys again when it has changed; what cannot be read leaves the keys as they are."""

    def __init__(self, path: Path, others: tuple[ApiKey, ...]) -> None:
        self._path = path
        self._others = others
        self._stamp = self._present_stamp()

    def __call__(self) -> tuple[ApiKey, ...] | None:
        stamp = self._present_stamp()
        if stamp == self._stamp:
            return None
        self._stamp = stamp
        try:
            keys = self._others + _keys_in(self._path)
        except KeysUnusable as error:
            log.error("the keys stay as they were: %s", error)
            return None
        log.warning("the keys were read again: %d", len(keys))
        return keys

    def _present_stamp(self) -> tuple[int, ...] | None:
        try:
            stat = self._path.stat()
        except OSError:
            return None
        return stat.st_ino, stat.st_mtime_ns, stat.st_size


def new_key() -> str:
    """A new key."""
    return PREFIX + secrets.token_urlsafe(32)


def hash_line(name: str, key: str) -> str:
    """What the service is given of a key."""
    return f"{name}:sha256:{_digest(key).hex()}"


def keyring(settings: Access) -> Keyring:
    """The keys of the settings.

    Raises:
        KeysUnusable: there is something, but it is no list of keys; the service must not start open then.
    """
    keys = _parsed(settings.api_keys.replace(",", " ").split(), "DUOCELL_API_KEYS, entry")
    if settings.api_keys_file is None:
        return Keyring(keys)
    reload = _KeysFile(settings.api_keys_file, keys)
    from_file = _keys_in(settings.api_keys_file)
    if not from_file:
        raise KeysUnusable(f"DUOCELL_API_KEYS_FILE: {settings.api_keys_file} holds no key; a line is {FORM}")
    return Keyring(keys + from_file, reload)


def _keys_in(path: Path) -> tuple[ApiKey, ...]:
    """The keys of a file; perhaps none."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is no UTF-8 text"
        raise KeysUnusable(f"DUOCELL_API_KEYS_FILE: {path} cannot be read: {why}") from error
    return _parsed(lines, f"{path}, line")


def _parsed(lines: list[str], place: str) -> tuple[ApiKey, ...]:
    """Hash lines; blank ones and comments are skipped."""
    keys = []
    for number, raw in enumerate(lines, 1):
        line = raw.split("#")[0].strip()
        if not line:
            continue
        match = _LINE.fullmatch(line)
        if match is None:
            raise KeysUnusable(f"{place} {number}: no hash line; it must be {FORM}")
        keys.append(ApiKey(match["name"], bytes.fromhex(match["digest"])))
    return tuple(keys)


def _digest(key: str) -> bytes:
    return hashlib.sha256(key.encode("utf-8", "surrogatepass")).digest()
