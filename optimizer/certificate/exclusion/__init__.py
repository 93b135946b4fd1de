"""What surely collides, stands off the floor or is too near to a singularity, wherever in a box a base stands.

Where joint 1 turns about the base's own axis, all bodies but the base's stand still while the base yaws: over a box of
base positions they move little, and the part that the hand holds not at all. From the ground up:

- `inscribed`: capsules, balls and edges inside of bodies; `gap`: how far points are from a shape;
- `bodies`: those of one arm, and all that it must keep away from; `causes`: why a box holds no layout;
- `motion`: how far bodies move over a box, as a ball and to first order;
- `points`: bodies against obstacles and part; `self_contact`: links against each other; `conditioning`;
- `yaw`: base link, pedestal and footprint, through the yaws that are left to them;
- `exclude`: all tests of one arm in the order of their cost.

Every test gives an upper bound of what is kept beyond what is required (its *slack*, in metres, or in units of
σmin/σmax); a box is excluded where that is below `causes.TOLERANCE`.
"""
