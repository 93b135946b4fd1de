"""The search of cells whose arms something couples: ties between bases, a floor, distances to keep along the path.

Optima of the arms by themselves are the answer where they fit together; else whole layouts are sampled and refined
until the path is clean at and between its poses.
"""
