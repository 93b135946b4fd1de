"""All bodies of a cell and all pairs of them that must keep apart, as arrays."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.catalogue.self_pairs import self_pairs
from duocell.models.cell.mounting import DEPTH, face_depth
from duocell.models.cell.surroundings import PairClass, Part, Surroundings
from duocell.models.collision.grasp_zone import outside_zones
from duocell.models.geometry.bounding import Bounding, bounding
from duocell.models.geometry.floor_level import ends_at, lowest
from duocell.models.geometry.shapes import Body, HalfSpace
from duocell.models.robot.arm import Arm


class Owner(NamedTuple):
    """What a body moves with.

    Attributes:
        arm: index of the arm, or None for the world and the part.
        link: of that arm, 0 for its base; None for the world and the part.
        part: True for the object frame.
    """

    arm: int | None
    link: int | None
    part: bool = False


WORLD = Owner(None, None)
OBJECT = Owner(None, None, part=True)
EVERY = -1
"""In place of a segment's number."""
Entry = tuple[str, Owner, Body]
"""Name, owner and body."""
_ARM, _OBSTACLE, _PART, _PIECE = "arm", "obstacle", "part", "piece"
"""Groups of bodies: with the number of an arm, 0, 0, the number of a segment."""


@dataclass(frozen=True, eq=False)
class CellBodies:
    """Bodies and pairs.

    Frames are numbered: 0 world, 1 object, then links 0 to n of each arm in turn.

    Attributes:
        names: (B) for people.
        owners: (B).
        bodies: (B) poses are in the owner's frame.
        sure: (B) the same, but of pedestals that are as high as their base stands what is there at every height.
        frames: (B,) number of the owner's frame.
        ends: (B, 2, 3) m, axis of the bounding capsule in the owner's frame. radius: (B,) m of that capsule.
        box_poses: (B, 4, 4) bounding box in the owner's frame. half: (B, 3) m of that box.
        rounded: (B,) True where the bounding capsule is the body.
        flat: (B,) True for half-spaces, which have neither capsule nor box.
        first: (P,) index of a pair's first body, never flat. second: (P,) likewise, may be flat.
        kinds: (P) classes of the pairs.
        mounts: (P,) True where the first body is the base of an arm, which the second body may carry.
        segments: (P,) the segment of the task in which a pair counts, -1 for all segments. The part without its grasp
            zones is another one in each segment if some arm's grasp is.
    """

    names: tuple[str, ...]
    owners: tuple[Owner, ...]
    bodies: tuple[Body, ...]
    sure: tuple[Body, ...]
    frames: Ints
    ends: Floats
    radius: Floats
    box_poses: Floats
    half: Floats
    rounded: Bools
    flat: Bools
    first: Ints
    second: Ints
    kinds: tuple[PairClass, ...]
    mounts: Bools
    segments: Ints


def frame_offsets(arms: Sequence[Arm]) -> list[int]:
    """Number of each arm's link 0, and after the last arm the number of all frames."""
    return [2 + sum(arm.dof + 1 for arm in arms[:a]) for a in range(len(arms) + 1)]


def collect(arms: Sequence[Arm], surroundings: Surroundings, holders: Sequence[Arm] | None = None) -> CellBodies:
    """All bodies of a cell, and the pairs of the classes that a clearance is asked for.

    ``holders`` are all arms that hold the part, where ``arms`` are only some of them: the part is left out around the
    grasps of all. Left out as pairs: what an arm's last link and tool have with the part (they hold it), pairs of one
    arm that `self_pairs` leaves out, two half-spaces. The last few cells are kept: their models are built often.
    """
    return _collected(tuple(arms), surroundings, None if holders is None else tuple(holders))


@lru_cache(maxsize=4)
def _collected(arms: tuple[Arm, ...], surroundings: Surroundings, holders: tuple[Arm, ...] | None) -> CellBodies:
    entries: list[Entry] = []
    groups: dict[tuple[str, int], list[int]] = {}
    for group, entry in _grouped(arms, surroundings, arms if holders is None else holders):
        groups.setdefault(group, []).append(len(entries))
        entries.append(entry)
    bounds = [None if isinstance(body.shape, HalfSpace) else bounding(body.shape) for _, _, body in entries]
    pairs = _pairs(arms, surroundings, entries, groups)
    segment_of = {i: segment for (group, segment), members in groups.items() if group == _PIECE for i in members}
    return _arrays(arms, surroundings, entries, bounds, pairs, [segment_of.get(j, EVERY) for _, _, j in pairs])


def _grouped(
    arms: Sequence[Arm], surroundings: Surroundings, holders: Sequence[Arm]
) -> Iterator[tuple[tuple[str, int], Entry]]:
    """All bodies with the group that they belong to: an arm, the obstacles, the part, its pieces of a segment."""
    for a, arm in enumerate(arms):
        yield from (((_ARM, a), entry) for entry in _of_arm(a, arm, surroundings))
    yield from (((_OBSTACLE, 0), (obstacle.name, WORLD, obstacle)) for obstacle in surroundings.obstacles)
    if surroundings.part is None:
        return
    bodies = surroundings.part.bodies
    yield from (((_PART, 0), (body.name, OBJECT, body)) for body in bodies)
    for segment, grasps in _grasps(holders, surroundings.part):
        pieces = outside_zones(bodies, grasps, surroundings.part.grasp_zone)
        yield from (((_PIECE, segment), (body.name, OBJECT, body)) for body in pieces)


def _of_arm(a: int, arm: Arm, surroundings: Surroundings) -> Iterator[Entry]:
    """Pedestal, links and tool of an arm."""
    equipment = surroundings.of(arm.name)
    if equipment.pedestal is not None:
        yield f"{arm.name} pedestal", Owner(a, 0), equipment.pedestal.body
    for link in surroundings.links(arm):
        yield f"{arm.name} {link.body.name}", Owner(a, link.link), link.body
    for tool in equipment.tool:
        moved = Body(tool.name, arm.robot.flange_placement @ tool.pose, tool.shape)
        yield f"{arm.name} {tool.name}", Owner(a, arm.dof), moved


def _grasps(arms: Sequence[Arm], part: Part) -> list[tuple[int, Floats]]:
    """Segments with the (a, 3) m grasp points of all arms; one entry for all segments where they have the same."""
    segments = max((len(arm.grasps) for arm in arms if arm.grasps is not None), default=0)
    if not segments or part.grasp_zone == 0.0:
        return [(EVERY, np.array([arm.grasp[:3, 3] for arm in arms]).reshape(-1, 3))]
    return [
        (segment, np.array([(arm.grasp if arm.grasps is None else arm.grasps[segment])[:3, 3] for arm in arms]))
        for segment in range(segments)
    ]


def _pairs(
    arms: Sequence[Arm],
    surroundings: Surroundings,
    entries: list[Entry],
    groups: dict[tuple[str, int], list[int]],
) -> list[tuple[PairClass, int, int]]:
    """Pairs of the classes asked for."""
    of_arm = [groups.get((_ARM, a), []) for a in range(len(arms))]
    obstacles, part = (groups.get((group, 0), []) for group in (_OBSTACLE, _PART))
    pieces = [j for (group, _), members in groups.items() if group == _PIECE for j in members]
    pairs: list[tuple[PairClass, int, int]] = []
    for a, (arm, own) in enumerate(zip(arms, of_arm, strict=True)):
        others = [j for later in of_arm[a + 1 :] for j in later]
        off_the_part = [i for i in own if entries[i][1].link != arm.dof]  # the last link holds it
        floor = _stood_on(surroundings, arm, [(j, entries[j][2]) for j in obstacles])
        pairs += [(PairClass.ARM_ARM, i, j) for i in own for j in others]
        pairs += [(PairClass.ARM_PART, i, j) for i in off_the_part for j in pieces]
        pairs += [
            (PairClass.ARM_OBSTACLE, i, j) for i in own for j in obstacles if entries[i][1].link != 0 or j not in floor
        ]
        if surroundings.clearances.required(PairClass.SELF) is not None:
            pairs += _self_pairs(arm, surroundings, entries, own)
    pairs += [(PairClass.PART_OBSTACLE, i, j) for i in part for j in obstacles]
    return [pair for pair in pairs if surroundings.clearances.required(pair[0]) is not None]


def _self_pairs(
    arm: Arm, surroundings: Surroundings, entries: list[Entry], own: list[int]
) -> list[tuple[PairClass, int, int]]:
    """Pairs of an arm's own bodies that can meet."""
    links = [entries[i][1].link or 0 for i in own]
    solids = _with_plate(surroundings, arm, [entries[i][2] for i in own])
    kept = self_pairs(arm.robot, links, solids, [bounding(b.shape) for b in solids], arm.lower, arm.upper)
    return [(PairClass.SELF, own[i], own[j]) for i, j in kept]


def _with_plate(surroundings: Surroundings, arm: Arm, bodies: list[Body]) -> list[Body]:
    """Bodies of an arm with the plate of its pedestal for all of it: a height must not decide what keeps off it."""
    pedestal = surroundings.of(arm.name).pedestal
    return bodies if pedestal is None else [pedestal.plate.body, *bodies[1:]]


def _sure(arms: Sequence[Arm], surroundings: Surroundings, entries: list[Entry]) -> tuple[Body, ...]:
    """The bodies; of a pedestal, which is the first of its arm's, what is there wherever the base may stand."""
    bodies, owners = [body for _, _, body in entries], [owner for _, owner, _ in entries]
    for a, arm in enumerate(arms):
        pedestal = surroundings.of(arm.name).pedestal
        if pedestal is not None and pedestal.foot is not None:
            bodies[owners.index(Owner(a, 0))] = pedestal.surely_under(arm.base.z.low).body
    return tuple(bodies)


def _stood_on(surroundings: Surroundings, arm: Arm, obstacles: list[tuple[int, Body]]) -> set[int]:
    """Numbers of the obstacles that end at the floor to which an arm's pedestal reaches."""
    pedestal = surroundings.of(arm.name).pedestal
    foot = None if pedestal is None else pedestal.foot
    return set() if foot is None else {number for number, body in obstacles if ends_at(body, foot)}


def _arrays(
    arms: Sequence[Arm],
    surroundings: Surroundings,
    entries: list[Entry],
    bounds: list[Bounding | None],
    pairs: list[tuple[PairClass, int, int]],
    segments: list[int],
) -> CellBodies:
    """Everything as arrays; half-spaces get zeros where they have nothing."""
    offsets = frame_offsets(arms)
    count = len(entries)
    ends, radius = np.zeros((count, 2, 3)), np.zeros(count)
    boxes, half = np.tile(np.eye(4), (count, 1, 1)), np.zeros((count, 3))
    frames = np.zeros(count, dtype=np.int64)
    for i, ((_, owner, body), bound) in enumerate(zip(entries, bounds, strict=True)):
        if owner.arm is not None and owner.link is not None:
            frames[i] = offsets[owner.arm] + owner.link
        else:
            frames[i] = int(owner.part)
        boxes[i] = body.pose
        if bound is not None:
            ends[i] = bound.ends @ body.pose[:3, :3].T + body.pose[:3, 3]
            radius[i], half[i] = bound.radius, bound.half
            boxes[i, :3, 3] += body.pose[:3, :3] @ bound.centre
    standing = [_at_the_face(arms, surroundings, owner, body) for _, owner, body in entries]
    mounts = [kind is PairClass.ARM_OBSTACLE and standing[i] for kind, i, _ in pairs]
    return CellBodies(
        names=tuple(name for name, _, _ in entries),
        owners=tuple(owner for _, owner, _ in entries),
        bodies=tuple(body for _, _, body in entries),
        sure=_sure(arms, surroundings, entries),
        frames=frames,
        ends=ends,
        radius=radius,
        box_poses=boxes,
        half=half,
        rounded=np.array([bound is not None and bound.exact for bound in bounds], dtype=np.bool_),
        flat=np.array([bound is None for bound in bounds], dtype=np.bool_),
        first=np.array([i for _, i, _ in pairs], dtype=np.int64),
        second=np.array([j for _, _, j in pairs], dtype=np.int64),
        kinds=tuple(kind for kind, _, _ in pairs),
        mounts=np.array(mounts, dtype=np.bool_),
        segments=np.array(segments, dtype=np.int64),
    )


def _at_the_face(arms: Sequence[Arm], surroundings: Surroundings, owner: Owner, body: Body) -> bool:
    """True for a body of the base: link 0, and what of link 1 lies at the mounting face however the first joint turns.

    Arms whose first joint has its origin in the mounting face have the metal of their base in link 1, and estimated
    capsules reach down to the face.
    """
    if owner.arm is None or owner.link not in (0, 1):
        return False
    if owner.link == 0:
        return True
    arm = arms[owner.arm]
    placement = arm.robot.joint_placements[0]
    upright = not arm.robot.slides and abs(float(placement[2, :3] @ arm.robot.joint_axes[0])) > 1.0 - 1e-9
    placed = Body(body.name, placement @ body.pose, body.shape)
    return upright and lowest(placed) + face_depth(surroundings, arm) < DEPTH
