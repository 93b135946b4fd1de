"""`duocell key new`: make an API key."""

from __future__ import annotations

import sys

from duocell.service.cli.input import complain
from duocell.service.common.issues import Issue
from duocell.service.http.keys import NAME, hash_line, new_key


def new(name: str) -> int:
    """Make a key for somebody: its hash line goes to standard output, the key itself to standard error, once.

    So `duocell key new NAME >> KEYS` keeps the hash and shows the key; nothing keeps the key.
    """
    if NAME.fullmatch(name) is None:
        return complain([Issue("", f"{name!r} is no name for a key; letters, digits, '.', '_' and '-' are allowed.")])
    key = new_key()
    sys.stdout.write(hash_line(name, key) + "\n")
    sys.stdout.flush()
    sys.stderr.write(f"The key of {name}, shown this once:\n{key}\n")
    return 0
