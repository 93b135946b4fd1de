"""`duocell migrate`."""

from __future__ import annotations

import sys

from pydantic import ValidationError
from sqlalchemy.exc import SQLAlchemyError

from duocell.service.cli.exit_codes import Exit
from duocell.service.cli.input import complain
from duocell.service.common.issues import Issue
from duocell.service.common.job_errors import StoreUnavailable
from duocell.service.settings import Settings
from duocell.service.store.engine import make_engine
from duocell.service.store.migrate import upgrade


def migrate() -> int:
    """Bring the tables of the database that the settings name up to date."""
    try:
        settings = Settings()
    except ValidationError as error:
        return complain(Issue("", f"setting {'.'.join(map(str, e['loc']))}: {e['msg']}") for e in error.errors())
    try:
        if settings.database_url is None:
            settings.data_dir.mkdir(parents=True, exist_ok=True)
        engine = make_engine(settings.store_url(), patient=True)
        before, after = upgrade(engine)
        engine.dispose()
    except StoreUnavailable as error:
        sys.stderr.write(f"failed: {error.detail}\n")
        return Exit.FAILED
    except (SQLAlchemyError, OSError) as error:
        sys.stderr.write(f"failed: {error}\n")
        return Exit.FAILED
    done = "up to date already" if before == after else f"were at {before or 'nothing'}"
    sys.stdout.write(f"tables at revision {after}, {done}\n")
    return Exit.SOLVED
