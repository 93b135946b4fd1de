"""Pairs of boxes of two arms: what their couplings and their contact with each other exclude."""
