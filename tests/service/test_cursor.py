"""Cursors."""

from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.cursor import decode, encode
from service.problems import Problem


@given(st.datetimes(timezones=st.just(UTC)), st.text("0123456789abcdef", min_size=32, max_size=32))
def test_a_cursor_is_read_back(moment: datetime, job_id: str) -> None:
    assert decode(encode((moment, job_id))) == (moment, job_id)


@given(st.text(max_size=80))
def test_anything_else_is_refused(text: str) -> None:
    with pytest.raises(Problem) as caught:
        decode(text)
    assert caught.value.code == "invalid-request"
