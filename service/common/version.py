"""The version of this package."""

from __future__ import annotations

from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version


@lru_cache(maxsize=1)
def package_version() -> str:
    """Version of the installed package; "0" in a tree that was never installed."""
    try:
        return version("duocell")
    except PackageNotFoundError:
        return "0"
