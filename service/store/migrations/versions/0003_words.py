"""The time limit of a request, and the version that made a result: what its word means depends on it."""

from __future__ import annotations

import json

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"


def upgrade() -> None:
    """To this revision."""
    op.add_column("jobs", sa.Column("time_limit", sa.Double))
    op.add_column("jobs", sa.Column("version", sa.String(64)))
    jobs = sa.table("jobs", sa.column("id"), sa.column("result"), sa.column("version"))
    connection = op.get_bind()
    done = sa.select(jobs.c.id).where(jobs.c.result.is_not(None))
    for job_id in list(connection.scalars(done)):  # one by one: results may be long
        result = connection.scalar(sa.select(jobs.c.result).where(jobs.c.id == job_id))
        version = json.loads(str(result)).get("version")
        connection.execute(sa.update(jobs).where(jobs.c.id == job_id).values(version=version))
