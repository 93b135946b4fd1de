"""Cells, tasks and robot files by chance, each with an answer that is known, and kept ones."""
