"""Distances along a whole path, between the poses too."""
