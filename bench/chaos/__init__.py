"""A running server is treated badly, in every way that has once been found to matter: ``python -m bench.chaos``."""
