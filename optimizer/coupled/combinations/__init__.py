"""Whole layouts put together from a pool of candidates per arm, for arms that have few of them."""
