"""Run by Alembic, on the connection it is handed (`duocell.service.store.migrate`)."""

from __future__ import annotations

from alembic import context

from duocell.service.store.tables import Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    render_as_batch=True,  # SQLite changes a column by making the table anew
    compare_type=True,
)
context.run_migrations()
