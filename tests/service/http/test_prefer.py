"""Prefer: wait."""

import pytest

from duocell.service.http.prefer import preferred_wait


@pytest.mark.parametrize(
    ("headers", "seconds"),
    [
        ([], None),
        (["wait=10"], 10.0),
        (["WAIT = 10"], 10.0),
        (['wait="5"'], 5.0),
        (["respond-async, wait=3"], 3.0),
        (["respond-async", "wait=3"], 3.0),
        (["wait=3;foo=bar"], 3.0),
        (["wait=1, wait=2"], 1.0),
        (["wait=0"], 0.0),
        (["wait=100000"], 60.0),
        (["wait=-1"], None),
        (["wait=1.5"], None),
        (["wait"], None),
        (["handling=strict"], None),
        (["await=3"], None),
    ],
)
def test_seconds_of_a_header(headers: list[str], seconds: float | None) -> None:
    assert preferred_wait(headers, 60.0) == seconds
