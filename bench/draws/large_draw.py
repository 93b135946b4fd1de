"""Random large requests, up to the largest that the service takes, with random options."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np

from bench.trials.trial import draw_of
from duocell.service.library.user_mesh import UserMesh, mesh_document
from duocell.service.settings import Limits

TRIAL = "large_requests"
TIME_LIMIT = 5.0
"""s"""
ROBOTS = ("ur5e", "ur10e", "puma560", "iiwa14", "franka_panda", "yumi_left")
"""Closed forms with and without spherical wrists, and arms of seven joints."""
PIECES = (1, 10, 100)
"""Of the meshes `MESHES`."""
MESHES = tuple(f"pieces-{count}" for count in PIECES)
Request = dict[str, Any]


def meshes(seed: int = 0) -> dict[str, dict[str, Any]]:
    """Documents of the meshes that the requests name: convex pieces of about 0.1 m in a cube of 0.6 m."""
    rng = np.random.default_rng(seed)
    made = {}
    for name, count in zip(MESHES, PIECES, strict=True):
        pieces = tuple(
            rng.uniform(-0.05, 0.05, (24, 3)) + rng.uniform(-0.25, 0.25, 3)  # round enough to have many facets
            for _ in range(count)
        )
        bounds = np.array([[-0.3] * 3, [0.3] * 3])
        made[name] = mesh_document(UserMesh(name, name, "stl", 1, 44 * count, bounds, pieces, "2026-01-01T00:00:00Z"))
    return made


def large_request(seed: int, limits: Limits) -> Request:
    """One request; some are as large as they may be, most lie between, and every option is there in some."""
    rng = draw_of(TRIAL, seed)
    count = int(rng.integers(2, limits.max_arms + 1))
    arms = [_arm(rng, index, count) for index in range(count)]
    names = [arm["name"] for arm in arms]
    request: Request = {
        "name": f"{TRIAL} {seed}",
        "arms": arms,
        "time_limit": TIME_LIMIT,
        "max_joint_step": float(rng.uniform(0.5, pi)),
        **_task(rng, limits, names),
        **_bodies(rng, limits, arms),
    }
    if rng.random() < 0.5:
        request["coupling"] = _couplings(rng, names)
    if rng.random() < 0.4:
        request["floor"] = _floor(rng, limits)
    request.update(_options(rng))
    return request


def _options(rng: np.random.Generator) -> Request:
    """What else is asked for."""
    proofs: list[Any] = ["auto", None, {"gap": float(rng.uniform(1e-3, 0.1)), "time_limit": float(rng.uniform(1, 3))}]
    made: Request = {"certificate": proofs[rng.choice(3, p=(0.6, 0.15, 0.25))], "explain": bool(rng.random() < 0.4)}
    if rng.random() < 0.4:
        made["tolerance"] = {"position": 0.002, "angle": 0.00175}
    if rng.random() < 0.3:
        made["alternatives"] = int(rng.integers(1, 11))
    if rng.random() < 0.1:
        made["baselines"] = ["interior-penalty"]
    return made


def _largely(rng: np.random.Generator, least: int, most: int) -> int:
    """A number between, any order of magnitude alike; the largest in one of six draws."""
    return most if rng.random() < 1.0 / 6.0 else int(np.exp(rng.uniform(np.log(least), np.log(most))))


def _task(rng: np.random.Generator, limits: Limits, names: list[str]) -> Request:
    """A task, or a sequence of them, of up to ``limits.max_poses`` poses."""
    poses = _largely(rng, 10, limits.max_poses)
    jobs = int(rng.integers(2, 17)) if rng.random() < 0.35 else 1
    share = max(poses // jobs, 2)
    if jobs == 1:
        return {"task": _way(rng, share)}
    tasks = []
    for index in range(jobs):
        job: Request = {"name": f"job {index}", "task": _way(rng, share), "weight": float(rng.uniform(0.1, 2.0))}
        if rng.random() < 0.3:
            job["grasps"] = {str(rng.choice(names)): _pose(rng.uniform(-0.1, 0.1, 3), (0.0, 1.0, 0.0, 0.0))}
        tasks.append(job)
    return {"tasks": tasks}


def _way(rng: np.random.Generator, count: int) -> Request:
    """A line about the middle of the cell, written out or generated."""
    start = rng.uniform((-0.3, -0.3, 0.5), (0.3, 0.3, 0.9))
    end = start + rng.uniform(-0.4, 0.4, 3) * (1.0, 1.0, 0.4)
    turn = rng.uniform(-0.5, 0.5)
    last = (0.0, 0.0, float(np.sin(0.5 * turn)), float(np.cos(0.5 * turn)))
    if rng.random() < 0.5:
        return {"line": {"start": _pose(start, (0.0, 0.0, 0.0, 1.0)), "end": _pose(end, last), "count": count}}
    shares = np.linspace(0.0, 1.0, count)
    wave = 0.05 * np.sin(2.0 * pi * rng.integers(1, 6) * shares)
    places = start + shares[:, None] * (end - start) + wave[:, None] * (0.0, 0.0, 1.0)
    return {"poses": [_pose(place, (0.0, 0.0, 0.0, 1.0)) for place in places]}


def _arm(rng: np.random.Generator, index: int, count: int) -> Request:
    """One of the arms around the part, each of which reaches down to its grasp."""
    away = (index + rng.uniform(-0.2, 0.2)) * 2.0 * pi / count
    side = rng.uniform(0.3, 1.2)
    centre = rng.uniform(0.6, 1.0) * np.array([np.cos(away), np.sin(away)])
    arm: Request = {
        "name": f"arm {index}",
        "robot": str(rng.choice(ROBOTS)),
        "grasp": _pose(0.12 * np.sqrt(count) * np.array([np.cos(away), np.sin(away), 0.0]), (1.0, 0.0, 0.0, 0.0)),
        "base": {
            "x": [float(centre[0] - side), float(centre[0] + side)],
            "y": [float(centre[1] - side), float(centre[1] + side)],
            "z": [0.0, 0.5] if rng.random() < 0.3 else 0.0,
            "yaw": [-pi, pi] if rng.random() < 0.8 else 0.0,
        },
    }
    if rng.random() < 0.2:
        arm["min_conditioning"] = 0.02
    return arm


def _bodies(rng: np.random.Generator, limits: Limits, arms: list[Request]) -> Request:
    """Obstacles, the part, tools and distances; nothing of it in some cells."""
    if rng.random() < 0.15:
        return {}
    made: Request = {"obstacles": _obstacles(rng, limits)}
    if rng.random() < 0.5:
        shapes = [_solid(rng, 0.03, 0.06) for _ in range(_largely(rng, 1, limits.max_shapes))]
        made["part"] = {"shapes": shapes, "grasp_zone": 0.1}
    if rng.random() < 0.4:
        for arm in arms:
            arm["tool_shapes"] = [_solid(rng, 0.01, 0.03) for _ in range(_largely(rng, 1, limits.max_shapes))]
    if rng.random() < 0.3:
        made["clearance"] = {"arm_arm": 0.02, "arm_obstacle": 0.02, "self": None if rng.random() < 0.5 else 0.0}
    return made


def _obstacles(rng: np.random.Generator, limits: Limits) -> list[Request]:
    """Boxes, balls and meshes outside, some of them among the arms."""
    made: list[Request] = []
    left = limits.max_pieces
    for index in range(_largely(rng, 1, limits.max_obstacles)):
        away, far = rng.uniform(0.0, 2.0 * pi), rng.uniform(1.6, 3.5)
        place = (far * np.cos(away), far * np.sin(away), rng.uniform(0.0, 2.0))
        which = int(rng.choice(len(MESHES)))
        if rng.random() < 0.3 and PIECES[which] <= left:
            left -= PIECES[which]
            shape: Request = {"type": "mesh", "id": MESHES[which], "scale": float(rng.uniform(0.3, 1.0))}
        else:
            shape = _shape(rng, 0.02, 0.2)
        made.append({"name": f"obstacle {index}", "pose": _pose(place, (0.0, 0.0, 0.0, 1.0)), "shape": shape})
    return made


def _shape(rng: np.random.Generator, least: float, most: float) -> Request:
    size = float(rng.uniform(least, most))
    shapes: list[Request] = [
        {"type": "box", "size": [size, 0.5 * size, 0.8 * size]},
        {"type": "sphere", "radius": 0.5 * size},
        {"type": "cylinder", "radius": 0.4 * size, "length": size},
        {"type": "capsule", "radius": 0.3 * size, "length": size},
    ]
    return shapes[int(rng.integers(len(shapes)))]


def _solid(rng: np.random.Generator, least: float, most: float) -> Request:
    place = rng.uniform(-0.04, 0.04, 3)
    return {"pose": _pose(place, (0.0, 0.0, 0.0, 1.0)), "shape": _shape(rng, least, most)}


def _couplings(rng: np.random.Generator, names: list[str]) -> list[Request]:
    """Ties that most cells can keep."""
    pairs = [(one, other) for i, one in enumerate(names) for other in names[i + 1 :]]
    chosen = rng.permutation(len(pairs))[: _largely(rng, 1, len(pairs))]
    made: list[Request] = []
    for index in chosen:
        kind = rng.random()
        pair = list(pairs[index])
        if kind < 0.7:
            made.append({"type": "distance", "arms": pair, "minimum": float(rng.uniform(0.1, 0.6)), "maximum": 3.0})
        elif kind < 0.9 or len(made) > 0:
            made.append({"type": "same_z", "arms": pair})
        else:
            made.append({"type": "direction", "arms": pair, "angle": float(rng.uniform(-pi, pi))})
    return made


def _floor(rng: np.random.Generator, limits: Limits) -> Request:
    """A room with pits."""
    pits = []
    for _ in range(_largely(rng, 1, limits.max_polygons)):
        x, y = rng.uniform(-2.0, 2.0, 2)
        size = rng.uniform(0.02, 0.3)
        pits.append([[x, y], [x + size, y], [x + size, y + size], [x, y + size]])
    return {"allowed": [[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]], "forbidden": pits, "margin": 0.02}


def _pose(position: Any, quaternion: tuple[float, ...]) -> Request:
    return {"position": [float(value) for value in position], "orientation": {"quaternion": list(quaternion)}}
