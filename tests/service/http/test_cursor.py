"""Cursors."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from duocell.service.common.problems import Problem
from duocell.service.http.cursor import decode, encode


@given(st.integers(0, 2**63 - 1))
def test_a_cursor_is_read_back(number: int) -> None:
    assert decode(encode(number)) == number


@given(st.text(max_size=80))
def test_anything_else_is_refused(text: str) -> None:
    with pytest.raises(Problem) as caught:
        decode(text)
    assert caught.value.code == "invalid-request"
