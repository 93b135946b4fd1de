"""docs/jobs.md says what the service does."""

import re
import shlex
from dataclasses import fields
from pathlib import Path

from duocell.optimizer.monitoring import events
from duocell.optimizer.monitoring.events import Event
from duocell.service.cli.main import parser
from duocell.service.common.problems import KINDS
from duocell.service.jobs.job import JobStatus
from duocell.service.schemas.resources import Failure
from duocell.service.settings import Settings
from tests.support.markdown import blocks_of

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "jobs.md"
TEXT = PAGE.read_text()


def rows(heading: str) -> dict[str, str]:
    """First column -> second column of the table under a heading row."""
    table = TEXT[TEXT.index(heading) :].split("\n\n")[0].splitlines()[2:]
    return {cells[1].strip(" `"): cells[2].strip() for cells in (row.split("|") for row in table)}


def test_every_state_and_reason_is_listed() -> None:
    states = rows("| status | means |")
    assert list(states) == [status.value for status in JobStatus]
    published = (Failure.model_fields["code"].description or "").removeprefix("Stable name: ").rstrip(".")
    assert set(re.findall(r"`([a-z-]+)`", states["failed"])) - {"error"} == set(published.split(", "))


def test_every_event_is_listed_with_its_data() -> None:
    listed = rows("| event | data")
    kinds = {
        kind.kind: kind
        for kind in vars(events).values()
        if isinstance(kind, type) and kind is not Event and issubclass(kind, Event)
    }
    assert set(listed) == {"status", "done", *kinds}
    for name, kind in kinds.items():
        assert set(re.findall(r"`(\w+)`", listed[name])) >= {field.name for field in fields(kind)}, name


def test_the_settings_have_the_defaults_that_are_said() -> None:
    found = re.findall(r"^\| .* \| ([\d,]+) \| `DUOCELL_(\w+)` \|$", TEXT, re.M)
    assert len(found) == 8
    for value, name in found:
        assert float(value.replace(",", "")) == Settings.model_fields[name.lower()].default, name


def test_commands_and_addresses_exist() -> None:
    commands = [line for block in blocks_of(PAGE) for line in block.commands if line.startswith("duocell ")]
    assert len(commands) == 4
    for line in commands:
        parser().parse_args(shlex.split(line)[1:])
    from duocell.service.app import create_app

    paths = create_app(Settings()).openapi()["paths"]
    for method, path in re.findall(r"`(GET|POST|DELETE) (/v1/\S+?)`", TEXT):
        assert method.lower() in paths[path.replace("{id}", "{layout_id}")], path


def test_statuses_of_http_are_those_of_the_problems() -> None:
    for code, status in (("layout-finished", 409), ("layout-active", 409), ("idempotency-key-reused", 422)):
        assert KINDS[code].status == status
        assert f"`{status}`" in TEXT
