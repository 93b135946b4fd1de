"""What a worker is given of a job that waits or runs; jobs that are there have only their text."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"


def upgrade() -> None:
    """To this revision."""
    op.add_column("jobs", sa.Column("prepared", sa.LargeBinary))
