"""Proofs that a cell has no layout, each with its reason and what would help.

Before any search (`immediate`), cheapest first, each stage a proof by itself: couplings that contradict each other or
the base regions (`coupling_conflicts`), bodies whose places the task alone decides (`fixed_bodies`), links that no
joint angles keep apart (`self_distances`), poses out of reach and floors without room (`base_regions`), bases that
would have to stand in each other (`relative_bases`).
"""
