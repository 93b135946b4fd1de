"""Jobs: taken in, queued, dispatched, followed; nothing of HTTP and nothing of SQL."""
