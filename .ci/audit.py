"""Known vulnerabilities of what is locked: run by `make audit`, with the environment's Python.

pip-audit asks PyPI's advisory service about every pin of requirements-dev.lock, which holds those of requirements.lock
as well. Where it cannot be reached nothing is known, which is said and, unless `--strict` is given, is no failure: a
build without the internet must not break. A known vulnerability always is one, and so is a pin that the service has
never heard of while it knows the others.

    python .ci/audit.py [--strict]
"""

import json
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

LOCK = Path(__file__).parents[1] / "requirements-dev.lock"


@dataclass(frozen=True)
class Audit:
    """What came out: names and versions of what was looked up, what was not, and findings in words."""

    audited: list[str] = field(default_factory=list)
    skipped: list[str] = field(default_factory=list)
    findings: list[str] = field(default_factory=list)
    failure: str = ""


def audit(lock: Path) -> Audit:
    """Ask about every pin of a lock file."""
    command = [Path(sys.executable).with_name("pip-audit"), "--requirement", lock]
    options = ["--require-hashes", "--disable-pip", "--format", "json", "--progress-spinner", "off", "--timeout", "10"]
    done = subprocess.run([*map(str, command), *options], capture_output=True, text=True, check=False)
    return understood(done.stdout, done.stderr)


def understood(output: str, complaints: str = "") -> Audit:
    """What pip-audit's JSON says; without any the service could not be asked, and the last complaint says why."""
    try:
        dependencies = json.loads(output)["dependencies"]
    except (json.JSONDecodeError, KeyError):
        lines = complaints.strip().splitlines() or ["no reason given"]
        return Audit(failure=lines[-1][:200])
    audited, skipped, findings = [], [], []
    for entry in dependencies:
        if "skip_reason" in entry:
            skipped.append(entry["name"])
            continue
        pin = f"{entry['name']} {entry['version']}"
        audited.append(pin)
        for found in entry["vulns"]:
            fixed = ", ".join(found["fix_versions"]) or "no release yet"
            findings.append(f"{pin}: {', '.join([found['id'], *found.get('aliases', [])])}; fixed in {fixed}")
    return Audit(audited, skipped, findings)


def verdict(result: Audit, *, strict: bool) -> tuple[bool, list[str]]:
    """Whether the lock file passes, and what to say about it."""
    if not result.audited:
        why = result.failure or f"none of {len(result.skipped)} pins is known there: it is not PyPI itself that answers"
        return not strict, [f"NOT AUDITED: the advisory service cannot be reached ({why})"]
    said = [f"{len(result.audited)} pins audited, {len(result.findings)} known vulnerabilities"]
    said += [f"  {finding}" for finding in result.findings]
    said += [f"  unknown to the advisory service: {name}" for name in result.skipped]
    return not result.findings and not result.skipped, said


def main() -> int:
    """Audit, report."""
    passed, said = verdict(audit(LOCK), strict="--strict" in sys.argv[1:])
    print(f"{LOCK.name}: " + "\n".join(said))
    return 0 if passed else 1


if __name__ == "__main__":
    raise SystemExit(main())
