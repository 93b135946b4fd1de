"""How exactly the bases have to be where they should be.

The arms follow the same poses from bases that are a little off; what that costs says how far off they may be.
"""
