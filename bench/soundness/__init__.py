"""Bounds, exclusions and proofs against samples."""
