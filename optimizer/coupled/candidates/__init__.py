"""Whole layouts to start from: what couplings tie follows from the rest, which is sampled.

Placements that collide with what surrounds them are thrown out, and those left are put together, cheapest first.
"""
