"""Conflicts where nothing can be proved: the smallest set of requirements that every layout met so far breaks."""
