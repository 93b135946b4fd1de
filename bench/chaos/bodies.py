"""Bodies that are cheap to send and dear to read, and plain requests of any size to compare with."""

from __future__ import annotations

import json
from typing import Any

from duocell.service.schemas.evaluate import EVALUATE_EXAMPLE
from duocell.service.schemas.request import EXAMPLE

POSE = {"position": [0.8, 0.4, 0.1], "orientation": {"quaternion": [0.0, 0.0, 0.0, 1.0]}}
LARGEST = 7_900_000
"""Bytes; 8,000,000 are allowed."""


def hostile() -> dict[str, bytes]:
    """Names that stand twice, numbers without end, deep nesting, mistakes everywhere; small, middling and large."""
    names = ",".join(f'"n{k}":0' for k in range(40_000))
    return {
        "a name that stands twice": f'{{{names},"n39999":0}}'.encode(),
        "60,000 wrong poses": b'{"task":{"poses":[' + b",".join([b'{"position":[1,2,"x"]}'] * 60_000) + b"]}}",
        "400,000 wrong weights": b'{"arms":[{"name":"a","weights":[' + b",".join([b"-1"] * 400_000) + b"]}]}",
        "lists in lists": b'{"name":' + b"[" * 100_000 + b"]" * 100_000 + b"}",
        "a long name": b'{"name":"' + b"x" * 7_000_000 + b'"}',
        "200,000 unknown fields": b"{" + b",".join(b'"unknown%d":1' % k for k in range(200_000)) + b"}",
    }


def dear() -> dict[str, bytes]:
    """More of them, as large as bodies may be, and those that look like requests for as long as they can."""
    count = LARGEST // 16
    names = ",".join(f'"n{k:07}":0' for k in range(LARGEST // 13))
    wrong_pose = {"position": ["a"] * 3, "orientation": {"matrix": [["a"] * 3] * 3}}
    wrong_arm = EXAMPLE["arms"][0] | {"weights": ["a"] * 6, "name": ["a"]}
    obstacle = {"name": "o", "shape": {"type": "box", "size": ["a", 0, -1]}, "pose": wrong_pose}
    forms: dict[str, dict[str, Any]] = {
        "5,000 poses, all wrong": {"task": {"poses": [wrong_pose] * 5000}},
        "8 arms, all wrong": {"arms": [wrong_arm] * 8},
        "200 obstacles, all wrong": {"obstacles": [obstacle] * 200},
        "1.5 million weights that are texts": {"arms": [EXAMPLE["arms"][0] | {"weights": ["a"] * 1_500_000}]},
        "a million arms in a coupling": {"coupling": [{"type": "same_z", "arms": ["z"] * 1_000_000}]},
    }
    return hostile() | {
        "600,000 names, one of them twice": f'{{{names},"n0000000":0}}'.encode(),
        "empty lists": b"[" + b"[]," * (LARGEST // 3) + b"0]",
        "numbers": b"[" + b"1," * (LARGEST // 2) + b"0]",
        "720,000 unknown fields": b"{" + b",".join(b'"u%07d":1' % k for k in range(count)) + b"}",
        "digits": b'{"arms":' + b"9" * LARGEST + b"}",
        "escapes": b'{"name":"' + b"\\u0041" * (LARGEST // 6) + b'"}',
        "blanks": b" " * LARGEST,
        **{name: json.dumps(EXAMPLE | form).encode() for name, form in forms.items()},
    }


def plain(size: int) -> bytes:
    """A request with nothing wrong in it that has about so many bytes: poses, and joint values where these are few."""
    per_pose = len(json.dumps(POSE)) + 2
    if size <= 5000 * per_pose:
        return json.dumps(EXAMPLE | {"task": {"poses": [POSE] * max(1, size // per_pose)}}).encode()
    row = [0.123456789012345, -1.123456789012345, 2.123456789012345, 0.1, -0.2, 0.3]
    rows = min(5000, (size - 5000 * per_pose) // (8 * (len(json.dumps(row)) + 2)))
    first: dict[str, Any] = EVALUATE_EXAMPLE["arms"][0]
    arms = [first | {"name": f"arm {k}", "joints": [row] * 5000} for k in range(8)]
    if rows < 5000:
        arms = arms[: max(1, round(8 * rows / 5000))]
    text = json.dumps(EVALUATE_EXAMPLE | {"arms": arms, "task": {"poses": [POSE] * 5000}})
    return (text + " " * max(0, size - len(text))).encode()
