"""Distances between everything in a cell, their lower bounds and their gradients."""
