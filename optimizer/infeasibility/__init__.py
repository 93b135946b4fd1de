"""Proofs that a cell has no layout, each with its reason and what would help.

- `immediate`: what no base can help, before any search;
- `requirements`: what a cell asks for, taken apart; `subset_proof`: proofs for a part of it;
- `proved_conflict`: an irreducible set of requirements; `searched`: the same where nothing is proved;
- `changes`: of a request, by one number; `largest`: clearances that are possible; `resolve`: layouts of changed cells;
- `remedies`: the smallest numbers; `two_changes`: where one is not enough; `explain`: all of it, within an `effort`.
"""
