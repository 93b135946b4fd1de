"""Why a cell has no layout: the smallest set of requirements that contradict each other, and what would help.

Proofs are found before, during or after a search; where none is, the conflict is searched for and called so.
"""
