"""The way from older tables to those of this version."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sqlalchemy import Connection, Engine, inspect, text

from duocell.service.common.job_errors import StoreUnavailable
from duocell.service.store.engine import IMMEDIATE
from duocell.service.store.session_lock import SERVERS

if TYPE_CHECKING:
    from alembic.config import Config

HEAD = "0005"
"""The newest revision of the tables; named here so that an up-to-date store opens without loading Alembic."""


def revision(engine: Engine) -> str | None:
    """The revision of the tables in a database; None if there are none yet."""
    with engine.connect() as connection:
        if not inspect(connection).has_table("alembic_version"):
            return None
        found = connection.execute(text("SELECT version_num FROM alembic_version")).scalar()
    return None if found is None else str(found)


def upgrade(engine: Engine) -> tuple[str | None, str]:
    """Bring the tables up to date; returns the revisions before and after.

    Raises:
        StoreUnavailable: they belong to a newer version.
    """
    before = revision(engine)
    if before != HEAD:
        _refuse_unknown(before)
        from alembic import command

        with engine.execution_options(**{IMMEDIATE: True}).begin() as connection:  # all of it or nothing
            _refuse_while_open(connection)
            command.upgrade(configuration(connection), "head")
    return before, HEAD


def check_revision(engine: Engine) -> None:
    """See that the tables are those of this version.

    Raises:
        StoreUnavailable: they are not.
    """
    found = revision(engine)
    if found != HEAD:
        _refuse_unknown(found)
        have = "no tables yet" if found is None else f"tables of revision {found}"
        raise StoreUnavailable(f"The database has {have}, this version needs {HEAD}: run `duocell migrate` once.")


def configuration(connection: object = None) -> Config:
    """Alembic's configuration, on a connection."""
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", "duocell.service.store:migrations")
    config.attributes["connection"] = connection
    return config


def _refuse_while_open(connection: Connection) -> None:
    """A server of the version before would go on without knowing what the tables mean now. SQLite has a lock file."""
    if connection.dialect.name == "postgresql":
        alone = connection.execute(text("SELECT pg_try_advisory_xact_lock(:number)"), {"number": SERVERS}).scalar()
        if not alone:
            raise StoreUnavailable("A server has the database open: stop it, migrate, and start the new version.")


def _refuse_unknown(found: str | None) -> None:
    if found is not None and found > HEAD:
        raise StoreUnavailable(
            f"The tables are of revision {found}, newer than this version knows ({HEAD}): use the newer version."
        )
