"""Schemathesis against a live server, from the committed document: what it allows is answered as it says, what it does
not allow is refused, and nothing is ever a 5xx.

    python -m tests.clients.fuzz [EXAMPLES]     starts a server of its own; EXAMPLES per operation (default 100)
"""

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from duocell.service.cli.demo import serving
from duocell.service.http.keys import hash_line, new_key

ROOT = Path(__file__).parents[2]
DOCUMENT = ROOT / "docs" / "openapi.json"
SCHEMATHESIS = Path(sys.executable).with_name("schemathesis")
HOOKS = Path(__file__).with_name("hooks.py")
SEED = 20

CHEAP = {
    "DUOCELL_WORKERS": "1",
    "DUOCELL_MAX_POSES": "12",
    "DUOCELL_TIME_LIMIT": "0.5",
    "DUOCELL_MAX_CERTIFICATE_TIME": "10",
    "DUOCELL_MAX_WAIT": "0.3",
    "DUOCELL_MAX_QUEUED": "200",
    "DUOCELL_KEEP_JOBS": "100",
    "DUOCELL_LOG_FORMAT": "json",
}
"""Settings with which hundreds of accepted requests are no burden; the examples of the document are within them."""


@dataclass(frozen=True)
class Run:
    """What came out: cases that were sent, the report, and answers by status as the server's log has them."""

    cases: int
    passed: bool
    report: str
    statuses: Counter[int]
    errors: list[str]


def run(url: str, key: str, log: Path, examples: int, phases: str = "examples,coverage,fuzzing,stateful") -> Run:
    """Send everything that Schemathesis thinks of.

    Args:
        url: of the server. key: one that it knows.
        log: of the server.
        examples: per operation, in the phases of fuzzing and of sequences (stateful).
        phases: all, or some of them; coverage is the large one, with cases for every keyword of the schemas.
    """
    before = len(log.read_text().splitlines())
    with tempfile.TemporaryDirectory() as folder:  # it keeps a folder of its own in the working directory
        command = [SCHEMATHESIS, "--config-file", Path(__file__).with_name("schemathesis.toml"), "run", DOCUMENT]
        options = ["--url", url, "--header", f"X-API-Key: {key}", "--phases", phases]
        options += ["--seed", str(SEED), "--max-examples", str(examples)]
        environment = os.environ | {"NO_COLOR": "1", "COLUMNS": "200", "SCHEMATHESIS_HOOKS": str(HOOKS)}
        done = subprocess.run(
            [*map(str, command), *options], cwd=folder, env=environment, capture_output=True, text=True, check=False
        )
    counted = re.search(r"(\d+) generated", done.stdout)
    lines = [json.loads(line) for line in log.read_text().splitlines()[before:]]
    return Run(
        cases=int(counted[1]) if counted else 0,
        passed=done.returncode == 0,
        report=done.stdout + done.stderr,
        statuses=Counter(line["status"] for line in lines if line["event"] == "request"),
        errors=[line["event"] for line in lines if line["level"] in ("error", "critical")],
    )


def main() -> int:
    """The long run."""
    examples = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    key = new_key()
    os.environ |= CHEAP | {"DUOCELL_API_KEYS": hash_line("fuzz", key)}
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "log")
        with serving(log) as url:
            began = time.monotonic()
            result = run(url, key, log, examples)
    sys.stdout.write(result.report)
    sys.stdout.write(f"{result.cases} cases in {time.monotonic() - began:.0f} s; answers: {dict(result.statuses)}\n")
    sys.stdout.write("".join(f"error in the log: {error}\n" for error in result.errors))
    return 0 if result.passed and not result.errors else 1


if __name__ == "__main__":
    raise SystemExit(main())
