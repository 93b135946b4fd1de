"""Proofs before any search, cheapest first, each by itself.

Couplings that contradict each other or the base regions (`coupling_conflicts`), bodies whose places the task alone
decides (`fixed_bodies`), links that no joint angles keep apart (`self_distances`), poses out of reach and floors
without room (`base_regions`), bases that would have to stand in each other (`relative_bases`).
"""
