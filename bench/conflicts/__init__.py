"""Trials of what is said where there is no layout: conflicts that were planted, changes that undo them."""
