"""A small cell whose best layout is known: solved by every new worker, and again and again while the service runs."""

from __future__ import annotations

from typing import Any

from duocell.service.schemas.request import LayoutRequest

_STANDING_PART = {"rpy": [0.0, 3.141592653589793, 0.0]}

SELF_TEST = LayoutRequest.model_validate(
    {
        "name": "self-test",
        "task": {
            "line": {
                "start": {"position": [0.5, -0.1, 0.1], "orientation": _STANDING_PART},
                "end": {"position": [0.5, 0.1, 0.1], "orientation": _STANDING_PART},
                "count": 3,
            }
        },
        "arms": [
            {
                "name": "arm",
                "robot": "puma560",
                "grasp": {"position": [0.0, 0.0, 0.0], "orientation": {"quaternion": [0.0, 0.0, 0.0, 1.0]}},
                "base": {"x": [-0.2, 0.2], "y": [-0.2, 0.2], "z": 0.0, "yaw": 0.0},
            }
        ],
    }
).model_dump_json()

TOLERANCE = 1e-6
"""m and rad, of the independent verification."""


def check(result: dict[str, Any]) -> str:
    """What is wrong with the result of the self-test, or ""."""
    verification = result["verification"]
    if result["outcome"] != "optimal" or verification is None:
        return f"The self-test came out as {result['outcome']} instead of optimal."
    worst = max(verification["max_position_error"], verification["max_orientation_error"])
    if worst > TOLERANCE or not verification["limits_respected"]:
        return f"The layout of the self-test is wrong by {worst:g}."
    return ""
