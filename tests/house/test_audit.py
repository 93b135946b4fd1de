"""`make audit`: fails on what is known, says plainly when nothing could be asked."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

SCRIPT = Path(__file__).parents[2] / ".ci" / "audit.py"


@pytest.fixture(scope="module")
def audit() -> ModuleType:
    spec = importlib.util.spec_from_file_location("audit", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["audit"] = module  # dataclasses look themselves up
    spec.loader.exec_module(module)
    return module


def report(*dependencies: dict[str, Any]) -> str:
    return json.dumps({"dependencies": dependencies, "fixes": []})


CLEAN = {"name": "numpy", "version": "2.4.6", "vulns": []}
UNKNOWN = {"name": "casadi", "skip_reason": "Dependency not found on PyPI and could not be audited: casadi (3.8.2)"}
VULNERABLE = {
    "name": "pyyaml",
    "version": "5.3",
    "vulns": [{"id": "PYSEC-2021-142", "fix_versions": ["5.4"], "aliases": ["CVE-2020-14343"], "description": "..."}],
}


@pytest.mark.parametrize(
    ("output", "lenient", "strict", "words"),
    [
        (report(CLEAN), True, True, ["1 pins audited, 0 known"]),
        (report(CLEAN, VULNERABLE), False, False, ["pyyaml 5.3", "PYSEC-2021-142", "CVE-2020-14343", "5.4"]),
        (report(UNKNOWN), True, False, ["NOT AUDITED", "none of 1 pins"]),
        (report(UNKNOWN, CLEAN), False, False, ["unknown", "casadi"]),
        ("", True, False, ["NOT AUDITED", "no network"]),
        ("{}", True, False, ["NOT AUDITED", "no network"]),
    ],
    ids=["clean", "vulnerable", "unreachable", "half known", "no answer", "no report"],
)
def test_verdict(audit: ModuleType, output: str, lenient: bool, strict: bool, words: list[str]) -> None:
    result = audit.understood(output, "Traceback ...\nConnectionError: no network\n")
    passed, said = audit.verdict(result, strict=False)
    assert passed is lenient
    assert audit.verdict(result, strict=True)[0] is strict
    assert all(word in "\n".join(said) for word in words), said


@pytest.mark.parametrize(("options", "code"), [([], 0), (["--strict"], 1)])
def test_without_a_network_nothing_is_claimed(options: list[str], code: int) -> None:
    nowhere = {"HTTPS_PROXY": "http://127.0.0.1:9", "https_proxy": "http://127.0.0.1:9", "NO_PROXY": "", "no_proxy": ""}
    command = [sys.executable, str(SCRIPT), *options]
    run = subprocess.run(command, env=os.environ | nowhere, capture_output=True, text=True, check=False)
    assert run.returncode == code, run.stdout + run.stderr
    assert "NOT AUDITED" in run.stdout
