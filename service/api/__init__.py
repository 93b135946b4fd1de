"""Endpoints: they translate between HTTP and the rest of the service, and nothing else."""
