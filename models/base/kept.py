"""The one tolerance by which a distance or margin may be missed and still counts as kept."""

KEPT = 1e-6
"""m or rad; what is missed by less counts as kept, and so does equality: no robot cell is built to a micrometre."""
