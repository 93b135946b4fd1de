"""Checks of a path with numbers that did not produce it: poses, limits, posture, and the way between the poses."""
