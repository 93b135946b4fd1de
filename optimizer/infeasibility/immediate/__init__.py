"""Proofs before any search: what no placement of the bases can help. Each file is one of them."""
