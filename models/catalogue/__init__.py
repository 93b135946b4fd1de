"""Robots by name or by Denavit-Hartenberg parameters, and what is known of their links."""
