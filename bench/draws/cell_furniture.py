"""What is put around a drawn layout: obstacles in the way of tempting layouts, floor polygons, couplings."""

from __future__ import annotations

from dataclasses import replace
from math import atan2, cos, pi, sin

import numpy as np
from shapely import Polygon

from bench.draws.cell_draw import SLACK, Draw, base_frames, coarse, keeps_clear
from bench.judges.dense_bodies import DenseBodies
from bench.judges.dense_path import follow
from bench.judges.dense_rules import floor_gap
from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_x, rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Coupling, Direction, Distance, Mirror, Rail, SameHeight
from duocell.models.cell.floor import Floor
from duocell.models.geometry.shapes import Body, Box, Capsule, Cylinder, Shape, Sphere
from duocell.models.robot.arm import Interval

TRIES = 40


def with_obstacles(rng: np.random.Generator, drawn: Draw, heed: bool) -> Cell:
    """3 to 8 obstacles, the floor among them; ``heed``: none of them touches the known layout."""
    cell = drawn.cell
    wanted = int(rng.integers(2, 8))
    temptations = _bodies_of(drawn)
    for number in range(wanted):
        for _ in range(TRIES):
            body = _table(rng, drawn, number) if number < 2 and rng.random() < 0.5 else None
            body = body or _thing(rng, drawn, temptations, f"obstacle {number}")
            around = cell.surroundings
            alone = replace(cell, surroundings=replace(around, obstacles=(body,)))
            if not _part_passes(alone, drawn):
                continue
            if not heed or keeps_clear(alone, drawn.known.stands, drawn.paths, drawn.steps, SLACK):
                cell = replace(cell, surroundings=replace(around, obstacles=(*around.obstacles, body)))
                break
    return cell


def _part_passes(cell: Cell, drawn: Draw) -> bool:
    """True if the part itself keeps clear of the obstacles: nothing that arms do could help it."""
    clearances = replace(cell.surroundings.clearances, arm_arm=None, arm_part=None, arm_obstacle=None)
    clearances = replace(clearances, self_collision=None)
    bare = replace(cell, surroundings=replace(cell.surroundings, clearances=clearances))
    return keeps_clear(bare, drawn.known.stands, drawn.paths, drawn.steps, SLACK)


def _bodies_of(drawn: Draw) -> list[Floats]:
    """Places (3,) in the world where the arms of the tempting layout have their links, at every third sample."""
    cell, stands = drawn.cell, drawn.tempting.stands
    steps = coarse(cell.task, 4.0 * drawn.scale)
    bases = base_frames(cell, stands)
    paths = [follow(*one)[0] for one in zip(cell.arms, bases, [steps] * 2, drawn.tempting.joints, strict=True)]
    bodies = DenseBodies(cell, bases)
    places = []
    for k, pose in enumerate(steps.poses):
        placed = bodies.place([path[k] for path in paths], pose)
        places += [p[:3, 3] for p, solid in zip(placed, bodies.solids, strict=True) if solid.link in (1, 2, 3, 4)]
    return places


def _thing(rng: np.random.Generator, drawn: Draw, temptations: list[Floats], name: str) -> Body:
    """A pillar, cabinet, wall, duct, beam or tank, mostly where somebody would like to be."""
    s = drawn.scale
    region = drawn.cell.arms[0].base
    spot = np.array([rng.uniform(region.x.low, region.x.high), rng.uniform(region.y.low, region.y.high), 0.0])
    if rng.random() < 0.75:
        spot = temptations[rng.integers(len(temptations))] + rng.normal(0.0, 0.08 * s, 3)
    spot[2] = max(float(spot[2]), 0.05 * s)
    kind = rng.integers(6)
    turn = rotation_z(rng.uniform(-np.pi, np.pi))
    shape: Shape
    if kind == 0:  # pillar
        height = float(spot[2] + s * rng.uniform(0.1, 0.8))
        shape, spot[2] = Cylinder(float(s * rng.uniform(0.04, 0.12)), height), 0.5 * height
    elif kind == 1:  # cabinet
        height = float(spot[2] + s * rng.uniform(0.05, 0.3))
        shape, spot[2] = Box(np.array([*s * rng.uniform(0.15, 0.5, 2), height])), 0.5 * height
    elif kind == 2:  # wall
        height = float(s * rng.uniform(0.5, 1.5))
        shape, spot[2] = Box(np.array([s * rng.uniform(0.4, 1.2), 0.05 * s, height])), 0.5 * height
    elif kind == 3:  # duct
        turn = turn @ rotation_x(np.pi / 2)
        shape = Capsule(float(s * rng.uniform(0.03, 0.08)), float(s * rng.uniform(0.3, 1.2)))
    elif kind == 4:  # beam overhead, at any slant
        turn = turn @ rotation_x(rng.uniform(-0.3, 0.3))
        shape = Box(np.array([*s * rng.uniform(0.06, 0.12, 1), s * rng.uniform(0.4, 1.2), 0.1 * s]))
    else:
        shape = Sphere(float(s * rng.uniform(0.06, 0.18)))
    return Body(name, transform(turn, spot), shape)


def _table(rng: np.random.Generator, drawn: Draw, number: int) -> Body:
    """A table under the part at its first or last pose."""
    s, pose = drawn.scale, drawn.cell.task.poses[0 if number == 0 else -1]
    if drawn.cell.surroundings.part is None:
        raise AssertionError("drawn cells carry a part")
    body = drawn.cell.surroundings.part.bodies[0].shape
    if not isinstance(body, Box):
        raise AssertionError("drawn parts are boxes")
    top = float(pose[2, 3] - 0.5 * body.size[2] - 0.04 * s - 0.02)
    size = [body.size[0] * rng.uniform(0.3, 0.8), s * rng.uniform(0.2, 0.5), top]
    heading = atan2(pose[1, 0], pose[0, 0])
    return Body(f"obstacle {number}", transform(rotation_z(heading), [*pose[:2, 3], 0.5 * top]), Box(np.array(size)))


# --- floor ------------------------------------------------------------------------------------------------------------


def with_floor(rng: np.random.Generator, drawn: Draw, cell: Cell) -> Cell:
    """Perhaps an allowed polygon, perhaps forbidden ones, none of which rules the known layout out."""
    if rng.random() < 0.45:
        return cell
    margin = float(rng.choice([0.0, 0.02, 0.05]))
    allowed = None
    if rng.random() < 0.5:
        for _ in range(TRIES):
            polygon = _room(rng, drawn)
            if _stands_on(cell, drawn, Floor(polygon, (), margin)):
                allowed = polygon
                break
    forbidden: list[Floats] = []
    for _ in range(int(rng.integers(0 if allowed is not None else 1, 4))):
        for _ in range(TRIES):
            patch = _patch(rng, drawn)
            if _stands_on(cell, drawn, Floor(allowed, (patch,), margin)):
                forbidden.append(patch)
                break
    return replace(cell, surroundings=replace(cell.surroundings, floor=Floor(allowed, tuple(forbidden), margin)))


def _stands_on(cell: Cell, drawn: Draw, floor: Floor) -> bool:
    tried = replace(cell, surroundings=replace(cell.surroundings, floor=floor))
    return all(floor_gap(tried, a, stand) > 0.01 for a, stand in enumerate(drawn.known.stands))


def _room(rng: np.random.Generator, drawn: Draw) -> Floats:
    """A rectangle about the task, often with a corner missing."""
    middle = drawn.cell.task.poses[:, :2, 3].mean(axis=0)
    half = drawn.scale * rng.uniform(0.8, 1.8, 2)
    low, high = -half, half
    if rng.random() < 0.5:
        cut = half * rng.uniform(0.2, 0.9, 2)
        corners = [low, [high[0], low[1]], [high[0], high[1] - cut[1]], high - cut, [high[0] - cut[0], high[1]]]
        corners.append([low[0], high[1]])
    else:
        corners = [low, [high[0], low[1]], high, [low[0], high[1]]]
    turned: Floats = middle + np.array(corners) @ rotation_z(rng.uniform(-np.pi, np.pi))[:2, :2].T
    return turned


def _patch(rng: np.random.Generator, drawn: Draw) -> Floats:
    """A convex polygon, mostly about a tempting base."""
    stand = drawn.tempting.stands[rng.integers(2)][:2] + rng.normal(0.0, 0.25 * drawn.scale, 2)
    count = int(rng.integers(3, 7))
    angles = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False) + rng.uniform(0.0, 0.8)
    corners = stand + drawn.scale * rng.uniform(0.15, 0.45) * np.column_stack([np.cos(angles), np.sin(angles)])
    return np.array(Polygon(corners).exterior.coords[:-1])


# --- couplings --------------------------------------------------------------------------------------------------------


def coupled(rng: np.random.Generator, drawn: Draw) -> tuple[Draw, tuple[Coupling, ...]]:
    """Perhaps a coupling that the known layout obeys; a mirror may turn a base of it."""
    if rng.random() < 0.65:
        return drawn, ()
    first, second = drawn.known.stands
    apart = second[:2] - first[:2]
    angle, far = atan2(apart[1], apart[0]), float(np.linalg.norm(apart))
    level = abs(first[2] - second[2]) < 1e-12
    kinds = ["distance", "direction", *(["same_z", "rail", "rail", "mirror", "mirror"] if level else [])]
    match rng.choice(kinds):
        case "distance":
            nearer, farther = drawn.scale * rng.uniform(0.1, 0.4, 2)
            return drawn, (Distance((0, 1), max(0.0, far - nearer), far + farther),)
        case "direction":
            return drawn, (Direction((0, 1), angle),)
        case "same_z":
            return drawn, (SameHeight((0, 1)), Distance((0, 1), 0.7 * far))
        case "rail":
            point = (float(first[0]), float(first[1])) if rng.random() < 0.5 else None
            return drawn, (Rail((0, 1), angle, point),)
        case _:
            middle = 0.5 * (first[:2] + second[:2])
            plane = angle + 0.5 * pi
            turned = _turned(drawn, 1, 2.0 * plane - first[3] - second[3])
            return (drawn, ()) if turned is None else (turned, (Mirror((0, 1), (middle[0], middle[1]), plane),))


def _turned(drawn: Draw, index: int, turn: float) -> Draw | None:
    """The draw with one base turned by ``turn`` about its own axis, the arm staying where it is; None if it cannot."""
    arm, stand = drawn.cell.arms[index], drawn.known.stands[index].copy()
    stand[3] += turn
    first = arm.robot.joint_placements[0]
    sense = round(float(first[2, :3] @ arm.robot.joint_axes[0]))
    joints, path = drawn.known.joints[index].copy(), drawn.paths[index].copy()
    for lift in (0, -1, 1):
        shift = -sense * turn + 2.0 * pi * lift
        moved = path[:, 0] + shift
        if arm.lower[0] + 0.01 < moved.min() and moved.max() < arm.upper[0] - 0.01:
            joints[:, 0] += shift
            path[:, 0] = moved
            stands = drawn.known.stands.copy()
            stands[index] = stand
            known = replace(drawn.known, stands=stands, joints=_put(drawn.known.joints, index, joints))
            found = replace(drawn, known=known, paths=_put(drawn.paths, index, path))
            return found if keeps_clear(drawn.cell, stands, found.paths, drawn.steps, SLACK) else None
    return None


def _put(rows: tuple[Floats, ...], index: int, row: Floats) -> tuple[Floats, ...]:
    return (*rows[:index], row, *rows[index + 1 :])


def with_yaws(rng: np.random.Generator, drawn: Draw, cell: Cell) -> Cell:
    """Some bases may not turn freely: their yaw interval holds the known one."""
    arms = []
    for arm, stand in zip(cell.arms, drawn.known.stands, strict=True):
        if rng.random() < 0.25:
            yaw = Interval(float(stand[3] - rng.uniform(0.1, 1.5)), float(stand[3] + rng.uniform(0.1, 1.5)))
            arm = replace(arm, base=replace(arm.base, yaw=yaw))
        arms.append(arm)
    return replace(cell, arms=tuple(arms))


# --- cells that cannot be -------------------------------------------------------------------------------------------


def blocked(rng: np.random.Generator, drawn: Draw, cell: Cell, how: int) -> Cell:
    """The cell made impossible, each way for another reason."""
    around, s = cell.surroundings, drawn.scale
    match how:
        case 0:  # something stands where the part must pass
            poses = cell.task.poses
            k = int(rng.integers(1, len(poses)))
            spot = 0.5 * (poses[k - 1, :3, 3] + poses[k, :3, 3])
            post = Body("post", transform(np.eye(3), spot), Sphere(0.03 * s))
            return replace(cell, surroundings=replace(around, obstacles=(*around.obstacles[:7], post)))
        case 1:  # no floor is free for one arm
            region = cell.arms[0].base
            x, y = region.x, region.y
            corners = [[x.low - 1.0, y.low - 1.0], [x.high + 1.0, y.low - 1.0]]
            corners += [[x.high + 1.0, y.high + 1.0], [x.low - 1.0, y.high + 1.0]]
            return replace(cell, surroundings=replace(around, floor=Floor(None, (np.array(corners),), 0.0)))
        case 2:  # one arm may only stand too far away
            far = 3.5 * s + 2.0 * max(cell.arms[1].base.x.width, 1.0)
            arm = cell.arms[1]
            x = Interval(arm.base.x.low + far, arm.base.x.high + far)
            return replace(cell, arms=(cell.arms[0], replace(arm, base=replace(arm.base, x=x))))
        case 3:  # the bases must stand in each other
            return replace(cell, couplings=(Distance((0, 1), 0.0, 0.02 * s),))
        case _:  # a wall between one arm and the part
            return _walled(drawn, cell)


def _walled(drawn: Draw, cell: Cell) -> Cell:
    """The main arm may only stand behind a wall that is too high and too wide for it."""
    s = drawn.scale
    positions, stand = cell.task.poses[:, :3, 3], drawn.known.stands[0]
    middle = positions[:, :2].mean(axis=0)
    heading = atan2(stand[1] - middle[1], stand[0] - middle[0])
    away = np.array([cos(heading), sin(heading)])
    half = 0.5 * 1.2 * s  # the part and its way stay on this side
    edge = float(np.max(positions[:, :2] @ away)) + half + 0.1 * s
    wall_at = middle + away * (edge - middle @ away)
    wall = Body("wall", transform(rotation_z(heading), [*wall_at, 4.0 * s]), Box(np.array([0.1 * s, 30 * s, 8 * s])))
    box = wall_at + away * 0.6 * s
    arm = cell.arms[0]
    x, y = (Interval(float(c) - 0.15 * s, float(c) + 0.15 * s) for c in box)
    arms = (replace(arm, base=replace(arm.base, x=x, y=y)), cell.arms[1])
    around = cell.surroundings
    return replace(cell, arms=arms, surroundings=replace(around, obstacles=(*around.obstacles[:7], wall)))
