"""Alembic's scripts: one file in versions/ for every change of the tables."""
