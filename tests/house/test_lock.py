"""The lock files: complete, inside the bounds of pyproject.toml, usable on any machine."""

import re
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
LOCKS = ("requirements.lock", "requirements-dev.lock")
PIN = re.compile(
    r"^(?P<name>[a-z0-9][a-z0-9._-]*)==(?P<version>\S+) \\\n(?P<hashes>(?:    --hash=\S+(?: \\)?\n)+)", re.M
)


def pins(lock: str) -> dict[str, str]:
    return {match["name"]: match["version"] for match in PIN.finditer((ROOT / lock).read_text())}


def direct(*, dev: bool) -> list[Requirement]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    lines = project["dependencies"] + (project["optional-dependencies"]["dev"] if dev else [])
    return [Requirement(line) for line in lines]


@pytest.mark.parametrize("lock", LOCKS)
def test_lock_names_no_host_and_no_path(lock: str) -> None:
    text = (ROOT / lock).read_text()
    assert not re.search(r"://|--index-url|--extra-index-url|--find-links|--trusted-host|(^|\s)/\w", text)


@pytest.mark.parametrize("lock", LOCKS)
def test_every_requirement_is_pinned_with_hashes(lock: str) -> None:
    lines = [line for line in (ROOT / lock).read_text().splitlines() if re.match(r"\w", line)]
    assert {re.split("==", line)[0] for line in lines} == set(pins(lock))
    assert len(lines) > 40


@pytest.mark.parametrize("lock", LOCKS)
def test_lock_satisfies_the_bounds_of_the_project(lock: str) -> None:
    pinned = pins(lock)
    for requirement in direct(dev=lock == "requirements-dev.lock"):
        name = canonicalize_name(requirement.name)
        assert requirement.specifier.contains(pinned[name]), f"{requirement} but {name}=={pinned[name]}: make lock"


def test_every_run_time_requirement_is_bounded_from_both_sides() -> None:
    for requirement in direct(dev=False):
        operators = {specifier.operator for specifier in requirement.specifier}
        assert operators == {"~="} or operators == {">=", "<"}, str(requirement)


def test_both_locks_agree() -> None:
    everything = pins("requirements-dev.lock")
    assert {name: everything.get(name) for name in pins("requirements.lock")} == pins("requirements.lock")


def test_the_tests_run_with_the_locked_engines() -> None:
    pinned = pins("requirements-dev.lock")
    engines = ("casadi", "pin", "ssik", "numpy", "scipy", "fastapi", "pydantic")
    assert {name: version(name) for name in engines} == {name: pinned[name] for name in engines}


def test_notice_names_every_package_of_the_lock() -> None:
    notice = (ROOT / "NOTICE").read_text()
    missing = [
        name for name in pins("requirements.lock") if not re.search(rf"(?<![\w-]){re.escape(name)}(?![\w-])", notice)
    ]
    assert not missing
