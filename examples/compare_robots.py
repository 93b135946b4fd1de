"""Compare robots for one task: which of them can do it, and how far do they stay from their joint limits?"""

from math import degrees, pi, radians

import duocell

task = duocell.line(
    duocell.pose((0.0, 0.0, 0.4)), duocell.pose((0.6, 0.3, 0.6), rpy=(0.0, 0.0, radians(45.0))), count=12
)
grasp = duocell.pose((0.0, 0.0, 0.05), rpy=(pi, 0.0, 0.0))
tool = duocell.pose((0.0, 0.0, 0.15))

for robot in ("ur5e", "puma560"):  # `duocell robots` lists all names
    arm = duocell.make_arm("main", robot, x=(-1.5, 1.5), y=(-1.5, 1.5), grasp=grasp, tool=tool, min_conditioning=0.05)
    layout = duocell.optimize(duocell.Cell(task=task, arms=(arm,)))
    if not layout.usable:
        # "infeasible" is proved: no base in the square lets this robot do the task
        print(f"{robot}: {layout.outcome}. {layout.reasons[0].detail}")
        continue
    # Robots have limits and references of their own, so their objectives cannot be compared. Distances to the limits
    # can, and so can the conditioning: 0 at a singularity.
    placement = layout.placements[0]
    margin = degrees(placement.minimum_margin)
    print(
        f"{robot}: {layout.outcome}, {margin:.1f} degrees to a limit, conditioning {placement.minimum_conditioning:.3f}"
    )
