"""Lower bounds of an arm's reduced cost over boxes of base positions; what `duocell.optimizer.certificate` is made of.

From the ground up, each module with its own derivation:

- `ball`: intervals; `boxes`: the boxes;
- `angles`: what the joints do over a box (the task as the geometry sees it, joint values, slopes, remainders);
- `rules`: limits and objective; `twist`: the last three joints beside a singular wrist; `lifts`, `yaw`: what intervals
  of joint values cost at least (first order);
- `linear`, `tangent`: what expansions cost at least (second order);
- `box_bounds`: the bound of a box, or why it holds no solution; `obstacles`: those reasons, counted;
- `region`: where to look at all.
"""
