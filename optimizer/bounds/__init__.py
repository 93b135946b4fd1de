"""Lower bounds of an arm's reduced cost over boxes of base positions; what `optimizer.certificate` is made of.

From the ground up, each module with its own derivation:

- `ball`: intervals; `boxes`: the boxes; `targets`: the task as the geometry sees it;
- `front`, `triangle`, `wrist`: joint 1, elbow and shoulder, the last three joints; each encloses its angles over a box,
  their slopes, and how much the slopes can bend;
- `joints`: the three together, for both classes of arms; `expansion`: values, slopes and remainder of all joints;
- `rules`: limits and objective; `lifts`, `yaw`: what intervals of joint values cost at least (first order);
- `linear`, `tangent`: what expansions cost at least (second order);
- `box_bounds`: the bound of a box, or why it holds no solution; `obstacles`: those reasons, counted;
- `region`: where to look at all.
"""
