"""What surely collides, stands off the floor or is too near to a singularity, wherever in a box a base stands.

Every test gives an upper bound of what is kept beyond what is required (its *slack*); where that is negative by more
than a tolerance, the box holds no layout.
"""
