"""Ask why a cell has no layout, and what would help."""

from math import pi

import duocell

# The part is moved by 0.67 m, and the base may stand only on a strip that is too far away.
task = duocell.line(duocell.pose((0.0, 0.0, 0.4)), duocell.pose((0.6, 0.3, 0.6)), count=12)
arm = duocell.make_arm(
    "main",
    "ur5e",
    x=(-1.5, -0.8),
    y=(-1.5, 1.5),
    grasp=duocell.pose((0.0, 0.0, 0.05), rpy=(pi, 0.0, 0.0)),
    tool=duocell.pose((0.0, 0.0, 0.15)),
)
cell = duocell.Cell(task=task, arms=(arm,))

# An impossible cell is an answer, not an error. The explanation costs further solves, so it has to be asked for.
layout = duocell.optimize(cell, duocell.Settings(explain=True))
print(layout.outcome)  # infeasible: it is proved that there is no layout; unknown: none was found

for reason in layout.reasons:
    print(f"reason: {reason.detail}")

if layout.explanation is not None:
    # What cannot be had together, and the changes that were tried and help, cheapest first.
    print(f"conflict: {', '.join(layout.explanation.blocking)}")
    for change in layout.explanation.relaxations:
        print(f"remedy: {change.what}; the objective is then {change.objective:.1f}")
