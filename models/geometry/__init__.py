"""Shapes, meshes and the convex bodies that stand for them, and distances between two of them."""
