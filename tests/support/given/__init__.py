"""Arms, tasks and cells that are possible, or blocked, by construction."""
