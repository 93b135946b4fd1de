"""A PostgreSQL of our own: made in a temporary folder, reached through a socket there, gone afterwards."""

import os
import pwd
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

READY_WITHIN = 30.0
"""s"""


def binaries() -> Path | None:
    """Folder of the server's programs, newest version first."""
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"), key=lambda path: -int(path.parts[-3]))
    if found:
        return found[0].parent
    elsewhere = shutil.which("initdb")
    return Path(elsewhere).parent if elsewhere else None


def require() -> Path:
    """The programs.

    Raises:
        FileNotFoundError: they are not installed.
    """
    found = binaries()
    if found is None:
        raise FileNotFoundError("PostgreSQL is not installed: on Debian, apt-get install postgresql")
    return found


@contextmanager
def serving() -> Iterator[str]:
    """A running server without anything in it; yields its URL."""
    programs = require()
    # It refuses to run as root; Debian's package has made a user for it.
    user: dict[str, Any] = {} if os.geteuid() else {"user": "postgres", "group": "postgres", "extra_groups": []}
    with tempfile.TemporaryDirectory(prefix="duocell-pg-") as name:
        folder = Path(name)
        if user:
            account = pwd.getpwnam("postgres")
            os.chown(folder, account.pw_uid, account.pw_gid)
        made = ["-D", str(folder / "data"), "-U", "duocell", "--auth=trust", "--no-sync", "-E", "UTF8"]
        subprocess.run([str(programs / "initdb"), *made], check=True, capture_output=True, cwd=name, **user)
        options = {"listen_addresses": "", "unix_socket_directories": name, "fsync": "off", "max_connections": "40"}
        arguments = [part for key, value in options.items() for part in ("-c", f"{key}={value}")]
        with (folder / "log").open("wb") as log:
            server = subprocess.Popen(
                [str(programs / "postgres"), "-D", str(folder / "data"), *arguments],
                stdout=log,
                stderr=subprocess.STDOUT,
                cwd=name,
                **user,
            )
        try:
            wait_until_ready(programs, name, server, folder / "log")
            yield f"postgresql+psycopg://duocell@/postgres?host={name}"
        finally:
            server.send_signal(2)  # SIGINT: roll back what is open, disconnect everybody, write everything, end
            server.wait(30.0)


def wait_until_ready(programs: Path, folder: str, server: subprocess.Popen[bytes], log: Path) -> None:
    """Return when it takes connections.

    Raises:
        RuntimeError: it does not.
    """
    deadline = time.monotonic() + READY_WITHIN
    while subprocess.run([str(programs / "pg_isready"), "-h", folder], capture_output=True).returncode:
        if server.poll() is not None or time.monotonic() > deadline:
            raise RuntimeError(f"PostgreSQL did not start:\n{log.read_text()}")
        time.sleep(0.05)
