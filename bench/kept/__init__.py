"""Answers and documents that are kept, and compared with those of today."""
