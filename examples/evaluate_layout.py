"""Evaluate a layout without optimising: what does it cost to bolt an arm down somewhere else?"""

from math import degrees
from pathlib import Path

import duocell

request = duocell.read_request(Path(__file__).parent / "line.json")
best = duocell.optimize(request.cell, request.settings)

# Where a base stands: x, y, z in metres, and its yaw in radians.
bases = {placement.arm: [*placement.position, placement.yaw] for placement in best.placements}

for shift in (0.0, 0.05, 0.1):
    # The main arm is moved along x, the other one stays. The best path of the joints is found again for each.
    x, y, z, yaw = bases["main"]
    layout = duocell.evaluate(request.cell, {**bases, "main": [x + shift, y, z, yaw]})

    # feasible: it breaks no rule; infeasible: the reasons say which rules it breaks, where, and by how much.
    objective = "none" if layout.objective is None else f"{layout.objective:.1f}"
    print(f"{1000 * shift:.0f} mm: {layout.outcome}, objective {objective}")
    for reason in layout.reasons:
        print(f"  {reason.detail}")
    for placement in layout.placements:
        margins = [round(degrees(margin), 1) for margin in placement.joint_margins]
        print(f"  {placement.arm}: degrees from each joint to its limits {margins}")
