"""A sample of the trial of exclusions: no usable layout in a box that is excluded, none cheaper than a raised bound."""

from __future__ import annotations

import pytest

from bench.soundness.soundness import attempt


@pytest.mark.parametrize("number", [5, 7, 9, 11, 13, 15, 17, 21, 33, 10, 12])
def test_nothing_usable_is_excluded(number: int) -> None:
    counts = attempt(number, boxes=60, samples=4)
    assert not {name: count for name, count in counts.items() if name.endswith("wrong")}
