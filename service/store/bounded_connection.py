"""Connections to PostgreSQL on which nothing takes for ever, whether the server is busy, stopped, or out of reach."""

from __future__ import annotations

from typing import Any, TypeVar

import psycopg
from psycopg.abc import PQGen
from psycopg.errors import _WaitTimeout
from sqlalchemy import Engine, event

from duocell.service.jobs.job_store import NoAnswer

ANSWER_WITHIN = 4.0
"""s for the answer to a statement, of our own clock: a server that is stopped ends nothing by itself."""
STATEMENT_TIMEOUT, IDLE_TIMEOUT = 3_500, 5_000
"""ms after which the server gives up a statement, and a transaction in which nothing happens: a lock that it holds
would keep others waiting."""

Result = TypeVar("Result")


class Late(NoAnswer, psycopg.OperationalError):
    """`NoAnswer`, as an error of the driver."""


class BoundedConnection(psycopg.Connection[Any]):
    """A connection that is closed when an answer does not come in time."""

    def wait(self, gen: PQGen[Result], interval: float = 0.1, timeout: float | None = None) -> Result:
        """See psycopg; every statement, commit and rollback comes through here.

        Raises:
            OperationalError: there was no answer in time; whether the statement was carried out is not known.
        """
        try:
            return super().wait(gen, interval, ANSWER_WITHIN if timeout is None else timeout)
        except _WaitTimeout:
            self.close()
            raise Late(f"the database did not answer within {ANSWER_WITHIN:g} s") from None


def bound(engine: Engine) -> None:
    """Have an engine make such connections."""

    @event.listens_for(engine, "do_connect")
    def connect(dialect: Any, record: Any, arguments: Any, named: Any) -> BoundedConnection:
        made = BoundedConnection.connect(*arguments, **named, autocommit=True)
        made.execute(f"SET statement_timeout = {STATEMENT_TIMEOUT}")
        made.execute(f"SET idle_in_transaction_session_timeout = {IDLE_TIMEOUT}")
        made.autocommit = False
        return made
