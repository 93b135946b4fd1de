"""Trials of answers: a seeded draw per task, a judge, a table; continued where they stopped."""
