"""Where jobs outlive the process: `job_store` says what is promised, `sql` keeps it in SQLite or PostgreSQL."""
