"""Nonlinear programs of one arm or of whole cells: unknowns, rows, exact derivatives, and IPOPT."""
