"""Where jobs outlive the process: SQLite or PostgreSQL, behind the promise of `duocell.service.jobs.job_store`."""
