"""Nonlinear programs of whole cells and of one arm: rows, exact derivatives, IPOPT, and what a point means."""
