"""Whole layouts out of a pool of candidates per arm: for arms whose candidates are few and looked at closely."""
