"""Lower bounds of one arm's reduced cost over boxes of base positions.

Every file holds one step of the derivation: intervals of joint values, what they cost at least, and what can be said
to second order.
"""
