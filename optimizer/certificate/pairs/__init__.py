"""Pairs of boxes of two arms: what couplings and contact of the arms exclude, best first from the roots of both trees.

- `couplings`: ties between bases, by intervals; `mirrored_yaw`: what a mirrored yaw costs;
- `store`: what the contact of two arms needs to know of boxes; `contact`: arm against arm;
- `pair_tree`: the search over pairs.
"""
