"""The tables of the store. A change here needs a migration beside it; a test compares the two."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import (
    BigInteger,
    CheckConstraint,
    DateTime,
    ForeignKey,
    Index,
    LargeBinary,
    String,
    Text,
    UniqueConstraint,
)
from sqlalchemy.engine import Dialect
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column
from sqlalchemy.types import TypeDecorator

from duocell.service.jobs.job import JobStatus

STATES = ", ".join(f"'{status.value}'" for status in JobStatus)


class UtcTime(TypeDecorator[datetime]):
    """A moment. SQLite keeps no time zone: everything is UTC there."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """To UTC."""
        return None if value is None else value.astimezone(UTC)

    def process_result_value(self, value: Any, dialect: Dialect) -> datetime | None:
        """With its zone."""
        if value is None:
            return None
        moment: datetime = value
        return moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment.astimezone(UTC)


class Base(DeclarativeBase):
    """All tables."""


class JobRow(Base):
    """A job; see `duocell.service.jobs.job.Job`. The long texts come last: SQLite reads a row from its beginning."""

    __tablename__ = "jobs"
    __table_args__ = (
        CheckConstraint(f"status IN ({STATES})", name="jobs_status"),
        UniqueConstraint("client", "idempotency_key", name="jobs_key"),
        Index("jobs_created", "created_at", "id"),
        Index("jobs_sequence", "sequence"),
        Index("jobs_ended", "ended"),
        Index("jobs_state", "status", "sequence"),
    )

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    name: Mapped[str] = mapped_column(Text)
    client: Mapped[str] = mapped_column(Text)
    status: Mapped[str] = mapped_column(String(16))
    revision: Mapped[int]
    attempts: Mapped[int]
    owner: Mapped[str | None] = mapped_column(String(32))
    sequence: Mapped[int] = mapped_column(BigInteger, server_default="0")
    ended: Mapped[int | None] = mapped_column(BigInteger)
    ended_by: Mapped[str | None] = mapped_column(String(64))
    ended_detail: Mapped[str | None] = mapped_column(Text)
    created_at: Mapped[datetime] = mapped_column(UtcTime)
    started_at: Mapped[datetime | None] = mapped_column(UtcTime)
    finished_at: Mapped[datetime | None] = mapped_column(UtcTime)
    outcome: Mapped[str | None] = mapped_column(String(16))
    objective: Mapped[float | None]
    version: Mapped[str | None] = mapped_column(String(64))
    failure_code: Mapped[str | None] = mapped_column(String(64))
    failure_detail: Mapped[str | None] = mapped_column(Text)
    time_limit: Mapped[float | None]
    certificate_time: Mapped[float]
    runs: Mapped[int]
    idempotency_key: Mapped[str | None] = mapped_column(String(255))
    body_hash: Mapped[str] = mapped_column(String(64))
    request_hash: Mapped[str] = mapped_column(String(64))
    request: Mapped[str] = mapped_column(Text, deferred=True)
    result: Mapped[str | None] = mapped_column(Text, deferred=True)
    prepared: Mapped[bytes | None] = mapped_column(LargeBinary, deferred=True)


class EventRow(Base):
    """An event of a job; see `duocell.service.jobs.job.JobEvent`."""

    __tablename__ = "events"
    __table_args__ = ({"sqlite_with_rowid": False},)

    job_id: Mapped[str] = mapped_column(String(32), ForeignKey("jobs.id", ondelete="CASCADE"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    kind: Mapped[str] = mapped_column(String(32))
    data: Mapped[str] = mapped_column(Text)


class LeaseRow(Base):
    """One row: who owns the store; see `duocell.service.store.lease`.

    Attributes:
        owner: its token, None if nobody does. session: number of the session lock that it holds in PostgreSQL.
        beat: rises as long as the owner lives. changes: number of the last change of anything.
    """

    __tablename__ = "lease"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    owner: Mapped[str | None] = mapped_column(String(32))
    session: Mapped[int] = mapped_column(BigInteger)
    beat: Mapped[int] = mapped_column(BigInteger)
    changes: Mapped[int] = mapped_column(BigInteger)
