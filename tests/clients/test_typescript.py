"""TypeScript: types made from docs/openapi.json, a strict compilation, and the life of a job against a live server."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.clients.fuzz import DOCUMENT
from tests.support.guarded import Server

PROJECT = Path(__file__).parents[1] / "typescript"


def execute(folder: Path, *command: str) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=100)
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.mark.timeout(300)
def test_a_typescript_client_compiles_and_works(server: Server, tmp_path: Path) -> None:
    missing = [program for program in ("node", "npm") if shutil.which(program) is None]
    if missing and not os.environ.get("DUOCELL_CI"):
        pytest.skip(f"needs {' and '.join(missing)}")
    assert not missing, "Debian: apt-get install nodejs npm"
    folder = tmp_path / "typescript"
    shutil.copytree(PROJECT, folder)
    execute(folder, "npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--prefer-offline")
    modules = folder / "node_modules" / ".bin"
    options = ("--default-non-nullable=false", "--output", "schema.d.ts")
    execute(folder, str(modules / "openapi-typescript"), str(DOCUMENT), *options)
    execute(folder, str(modules / "tsc"), "--project", ".")
    told = execute(folder, "node", "out/client.js", server.url, server.key)
    name, *position, outcome = told.split()
    assert name == "arm"
    assert all(-0.2 <= float(value) <= 0.2 for value in position[:2])
    assert outcome == "optimal"
