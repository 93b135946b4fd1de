"""Whole layouts to start from: what couplings tie is taken out as unknowns, and the free ones are sampled.

Placements of every arm are sampled where its couplings can be kept exactly (`unknowns`), its inverse kinematics say
what they cost (`placements`), tests of one arm against its surroundings throw out what collides (`placement_filter`),
and what is left is put together, cheapest first (`extender`), without what collides among arms.
"""
