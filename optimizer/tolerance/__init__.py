"""How exactly the bases have to be where they should be.

A base is off by an error (`errors`), the arms follow the same object poses nevertheless, in the same postures
(`displaced`). What that costs is known to first order (`sensitivity`), which says where to look, and exactly at every
error that is looked at (`tolerance`).
"""
