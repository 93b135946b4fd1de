"""Seeded random tasks of one arm with a closed form, each of which some placement solves, and a judge of the answers.

``python -m bench.random_arms`` runs them; see `bench.random_arms.__main__`.
"""
