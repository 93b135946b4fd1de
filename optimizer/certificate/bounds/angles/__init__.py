"""Joint angles over boxes of base positions: enclosures, slopes, and how much the slopes can bend.

- `targets`: the task as the geometry sees it; `allowance`: what is left beside it;
- `front`, `triangle`, `wrist`: joint 1, elbow and shoulder, the last three joints;
- `joints`: the three together, for both classes of arms; `expansion`: values, slopes and remainder of all joints.
"""
