"""API keys: made here, known to the service by their hashes only.

A key is 32 random bytes, so that a plain SHA-256 of it can neither be guessed nor looked up; salts and slow hashes are
for passwords, which people choose.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
from collections.abc import Iterable
from dataclasses import dataclass

from service.settings import Access

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
    """The keys that are accepted; with none of them every request is."""

    def __init__(self, keys: Iterable[ApiKey] = ()) -> None:
        self._keys = tuple(keys)

    def __bool__(self) -> bool:
        return bool(self._keys)

    def owner(self, presented: str) -> str | None:
        """Whose key this is, or None. The time it takes does not depend on how much of it is right."""
        digest, found = _digest(presented), None
        for key in self._keys:
            if hmac.compare_digest(key.digest, digest):
                found = key.name
        return found


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
    if settings.api_keys_file is not None:
        path = settings.api_keys_file
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            why = error.strerror if isinstance(error, OSError) else "it is no UTF-8 text"
            raise KeysUnusable(f"DUOCELL_API_KEYS_FILE: {path} cannot be read: {why}") from error
        from_file = _parsed(lines, f"{path}, line")
        if not from_file:
            raise KeysUnusable(f"DUOCELL_API_KEYS_FILE: {path} holds no key; a line is {FORM}")
        keys += from_file
    return Keyring(keys)


def _parsed(lines: list[str], place: str) -> list[ApiKey]:
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
    return keys


def _digest(key: str) -> bytes:
    return hashlib.sha256(key.encode("utf-8", "surrogatepass")).digest()
