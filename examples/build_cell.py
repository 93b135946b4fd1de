"""Build a cell in Python, without a request: two UR10e carry a beam and turn it by 45 degrees."""

from math import degrees, pi, radians

import duocell

# What the part does: from the first pose to the last on a straight line, seen at ten places. Metres and radians; a pose
# is the frame of the part in the world, as a 4x4 array.
start = duocell.pose((0.0, 0.0, 0.8), rpy=(0.0, 0.0, radians(90.0)))
end = duocell.pose((0.6, 0.0, 0.9), rpy=(0.0, 0.0, radians(45.0)))
task = duocell.line(start, end, count=10)

# Who carries it: each arm holds one end of the beam from above, with a tool of 180 mm. Its base may stand anywhere in a
# rectangle and is turned freely; a single number, as for z, is fixed.
tool = duocell.pose((0.0, 0.0, 0.18))
down = (pi, 0.0, 0.0)  # the z axis of the tool points out of it, so it is turned over
arms = (
    duocell.make_arm(
        "left", "ur10e", x=(-1.0, 1.6), y=(0.3, 1.5), z=0.5, tool=tool, grasp=duocell.pose((0.5, 0.0, 0.05), rpy=down)
    ),
    duocell.make_arm(
        "right",
        "ur10e",
        x=(-1.0, 1.6),
        y=(-1.5, -0.3),
        z=0.5,
        tool=tool,
        grasp=duocell.pose((-0.5, 0.0, 0.05), rpy=down),
    ),
)
cell = duocell.Cell(task=task, arms=arms, name="beam")

layout = duocell.optimize(cell)
print(f"{cell.name}: {layout.outcome}")
for placement in layout.placements:
    x, y, _ = placement.position
    print(f"{placement.arm}: x {x:.3f} m, y {y:.3f} m, yaw {degrees(placement.yaw):.1f} degrees")
    # joints is an array of one row per pose and one column per joint
    print(f"  joints at the start [rad]: {placement.joints[0].round(3).tolist()}")
