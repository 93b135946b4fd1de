"""Faults: short in every run, long where DUOCELL_LONG is set (see docs/reliability.md)."""

import os

import pytest


@pytest.fixture
def long() -> bool:
    """Whether there is time."""
    return bool(os.environ.get("DUOCELL_LONG"))
