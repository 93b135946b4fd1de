"""A short run of `make fuzz`."""

from pathlib import Path

import pytest

from tests.clients import fuzz
from tests.support.guarded import guarded_server


@pytest.mark.timeout(300)  # twenty seconds on two free cores
def test_every_answer_is_as_documented(tmp_path: Path) -> None:
    with guarded_server(tmp_path / "log", fuzz.CHEAP) as server:
        result = fuzz.run(server.url, server.key, server.log, examples=15, phases="examples,fuzzing,stateful")
    assert result.passed, result.report
    assert result.errors == []
    assert result.cases >= 100
    assert {200, 404, 422} <= set(result.statuses)
    assert max(result.statuses) < 500
