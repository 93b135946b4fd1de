"""Solve a request from a file and write the answer: python examples/solve_request.py [REQUEST.json [RESULT.json]]."""

import json
import sys
from pathlib import Path

import duocell

source = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "line.json"

# A request is what the service takes at POST /v1/layouts (docs/request.md). If it cannot be carried out, the error
# lists everything that is wrong with it, each with its place in the file.
try:
    request = duocell.read_request(source)
except duocell.InvalidRequest as error:
    sys.exit("\n".join(f"{issue.pointer}: {issue.detail}" for issue in error.issues))

# The request says what is to be laid out (the cell), and how to look for it (the settings).
layout = duocell.optimize(request.cell, request.settings)

# optimal: proved to be the best; feasible: usable; infeasible: proved that there is none; unknown: neither.
print(f"{request.cell.name}: {layout.outcome}")
for reason in layout.reasons:
    print(reason.detail)
for placement in layout.placements:
    x, y, z = 1000.0 * placement.position  # metres, in the world
    print(f"{placement.arm}: x {x:.0f} mm, y {y:.0f} mm, z {z:.0f} mm, yaw {placement.yaw:.3f} rad")

# Request and result as one document: `duocell figure RESULT.json -o plan.svg` draws it, `duocell check` checks it.
if len(sys.argv) > 2:
    Path(sys.argv[2]).write_text(json.dumps(request.document(layout), indent=1), encoding="utf-8")
