"""Triangle meshes: reading them, and the convex bodies that stand for them."""
