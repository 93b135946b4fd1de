"""A short run of `make fuzz`."""

from collections.abc import Iterator

import pytest

from tests.clients import fuzz
from tests.clients.conftest import Server, started


@pytest.fixture
def fuzzed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    yield from started(tmp_path_factory.mktemp("fuzz") / "log")


def test_every_answer_is_as_documented(fuzzed: Server) -> None:
    result = fuzz.run(fuzzed.url, fuzzed.key, fuzzed.log, examples=25, phases="examples,fuzzing,stateful")
    assert result.passed, result.report
    assert result.errors == []
    assert result.cases >= 100
    assert {200, 202, 404, 422} <= set(result.statuses)
    assert max(result.statuses) < 500
