"""One file for every change of the tables, in the order of their numbers."""
