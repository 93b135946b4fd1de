"""A user who drags a base: how soon the layout is scored and verified, over HTTP."""

from __future__ import annotations

import json
from pathlib import Path
from time import perf_counter
from typing import Any

from bench.timings.server import Server

EXAMPLE = Path(__file__).parents[2] / "examples" / "beam_cell.json"
POSES = 16
DRAGS = 20
STEP = 0.002
"""m, by which one of the bases is further away each time."""


def drag(server: Server) -> list[float]:
    """s of every round trip of ``POST /v1/layouts/evaluate`` for two UR10e in the cell of the beam, with 16 poses."""
    request = json.loads(EXAMPLE.read_text())
    poses = request["task"]["poses"]
    for index in range(POSES - len(poses)):  # halfway between poses of the lifting, which only moves
        pair = poses[2 * index : 2 * index + 2]
        middle = [sum(values) / 2.0 for values in zip(*(pose["position"] for pose in pair), strict=True)]
        poses.insert(2 * index + 1, {**pair[0], "position": middle})
    _, resource = server.send("/v1/layouts", json.dumps(request).encode())
    times = []
    for number in range(DRAGS):
        placed = {**request, "arms": [_placed(arm, resource, number) for arm in request["arms"]]}
        body = json.dumps(placed).encode()
        began = perf_counter()
        server.send("/v1/layouts/evaluate", body)
        times.append(perf_counter() - began)
    return times


def _placed(arm: dict[str, Any], resource: dict[str, Any], number: int) -> dict[str, Any]:
    """An arm where the answer wants it, or a little off."""
    base = next(one["base"] for one in resource["result"]["arms"] if one["name"] == arm["name"])
    x, y, z = base["position"]
    return {
        **arm,
        "base": {"x": x - (STEP * number if arm["name"] == "main" else 0.0), "y": y, "z": z, "yaw": base["yaw"]},
    }
