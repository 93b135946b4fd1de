"""Who owns the store and each running job, the order of things without a clock, and what ended a job."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    """To this revision."""
    op.create_table(
        "lease",
        sa.Column("id", sa.Integer, primary_key=True, autoincrement=False),
        sa.Column("owner", sa.String(32)),
        sa.Column("session", sa.BigInteger, nullable=False),
        sa.Column("beat", sa.BigInteger, nullable=False),
        sa.Column("changes", sa.BigInteger, nullable=False),
    )
    op.drop_table("pulse")  # the lease is written instead
    op.add_column("jobs", sa.Column("owner", sa.String(32)))
    op.add_column("jobs", sa.Column("sequence", sa.BigInteger, nullable=False, server_default="0"))
    op.add_column("jobs", sa.Column("ended", sa.BigInteger))
    op.add_column("jobs", sa.Column("ended_by", sa.String(64)))
    op.add_column("jobs", sa.Column("ended_detail", sa.Text))
    op.get_bind().execute(sa.text("INSERT INTO lease VALUES (1, NULL, 0, 0, :changes)"), {"changes": _number()})
    op.drop_index("jobs_state", "jobs")
    op.drop_index("jobs_finished", "jobs")
    op.create_index("jobs_sequence", "jobs", ["sequence"])
    op.create_index("jobs_ended", "jobs", ["ended"])
    op.create_index("jobs_state", "jobs", ["status", "sequence"])


def _number() -> int:
    """Give jobs that are there the order that the clock gave them; the last number."""
    jobs = sa.table("jobs", *map(sa.column, ("id", "created_at", "finished_at", "sequence", "ended")))
    connection = op.get_bind()
    ids = list(connection.scalars(sa.select(jobs.c.id).order_by(jobs.c.created_at, jobs.c.id)))
    for number, job_id in enumerate(ids, 1):
        connection.execute(sa.update(jobs).where(jobs.c.id == job_id).values(sequence=number))
    done = sa.select(jobs.c.id).where(jobs.c.finished_at.is_not(None)).order_by(jobs.c.finished_at, jobs.c.id)
    for number, job_id in enumerate(list(connection.scalars(done)), 1):
        connection.execute(sa.update(jobs).where(jobs.c.id == job_id).values(ended=number))
    return len(ids)
