"""Every body of a cell in Coal, and every pair that must keep apart, read from the rules a second time.

What the bodies are is the project's (`duocell.models.catalogue.links`, `duocell.models.collision.grasp_zone`,
`duocell.models.catalogue.self_pairs`); where they are and how far apart is found out here, by Pinocchio and Coal
alone, one query per pair.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from bench.judges.dense_mounting import carriers, face_depth, is_base
from bench.judges.dense_shapes import coal_shape
from duocell.models.base.arrays import Floats
from duocell.models.catalogue.links import link_bodies
from duocell.models.catalogue.self_pairs import self_pairs
from duocell.models.cell.cell import Cell
from duocell.models.collision.grasp_zone import outside_zones
from duocell.models.geometry.bounding import bounding
from duocell.models.geometry.shapes import Body, HalfSpace
from duocell.models.kinematics.kinematics import pinocchio_model
from duocell.models.robot.arm import Arm


@dataclass(frozen=True, eq=False)
class Solid:
    """A body.

    Attributes:
        name: for people. arm: index, None for obstacles and the part. link: what it moves with; -1 without an arm.
        carried: True for the part. pose: (4, 4) in the frame it moves with.
        shape: Coal's. centre, radius: a ball around it, in the shape's frame; the radius of a half-space is infinite.
    """

    name: str
    arm: int | None
    link: int
    carried: bool
    pose: Floats
    shape: Any
    centre: Floats
    radius: float


class DenseBodies:
    """Bodies and pairs of a cell for given bases.

    Attributes:
        solids: all bodies. pairs: (class word, index, index).
    """

    def __init__(self, cell: Cell, bases: Floats) -> None:
        """Read the rules.

        Args:
            cell: what stands there, and the classes asked for.
            bases: (A, 4, 4) in the world: they decide what an arm is mounted on.
        """
        self.cell, self.bases = cell, bases
        around = cell.surroundings
        self.solids: list[Solid] = []
        of_arm = [self._arm(a, arm) for a, arm in enumerate(cell.arms)]
        obstacles = [self._add(o, None, -1) for o in around.obstacles]
        stands = [(self.solids[j].shape, self.solids[j].pose) for j in obstacles]
        part: list[int] = []
        pieces: list[int] = []
        if around.part is not None:
            grasps = np.array([arm.grasp[:3, 3] for arm in cell.arms])
            part = [self._add(body, None, -1, carried=True) for body in around.part.bodies]
            free = outside_zones(around.part.bodies, grasps, around.part.grasp_zone)
            pieces = [self._add(body, None, -1, carried=True) for body in free]
        pairs: list[tuple[str, int, int]] = []
        for a, arm in enumerate(cell.arms):
            depth = face_depth(cell, arm)
            carrying = {obstacles[k] for k in carriers(bases[a], depth, stands)}
            for i in of_arm[a]:
                pairs += [("arm_arm", i, j) for other in of_arm[a + 1 :] for j in other]
                if self.solids[i].link < arm.dof:
                    pairs += [("arm_part", i, j) for j in pieces]
                own = self.solids[i]
                exempt = carrying if is_base(arm, own.link, own.shape, own.pose, depth) else set()
                pairs += [("arm_obstacle", i, j) for j in obstacles if j not in exempt]
        pairs += [("part_obstacle", i, j) for i in part for j in obstacles]
        wanted = {"arm_arm", "arm_part", "arm_obstacle", "part_obstacle"}
        self.pairs = [p for p in pairs if p[0] in wanted and getattr(around.clearances, p[0]) is not None]
        if around.clearances.self_collision is not None:
            for a, arm in enumerate(cell.arms):
                self.pairs += [("self", of_arm[a][i], of_arm[a][j]) for i, j in self._self_pairs(arm)]
        self._data = [pinocchio_model(arm.robot).createData() for arm in cell.arms]

    # --- what there is ------------------------------------------------------------------------------------------------

    def _own(self, arm: Arm) -> list[tuple[str, int, Body]]:
        """(name, link, body in the link's frame) of one arm, pedestal first, tools last."""
        brings = self.cell.surroundings.of(arm.name)
        links = link_bodies(arm.robot) if brings.links is None else brings.links
        own = [("pedestal", 0, brings.pedestal.body)] if brings.pedestal is not None else []
        own += [(link.body.name, link.link, link.body) for link in links]
        flange = arm.robot.flange_placement
        own += [(tool.name, arm.dof, Body(tool.name, flange @ tool.pose, tool.shape)) for tool in brings.tool]
        return own

    def _arm(self, index: int, arm: Arm) -> list[int]:
        return [self._add(body, index, link, f"{arm.name} {name}") for name, link, body in self._own(arm)]

    def _self_pairs(self, arm: Arm) -> list[tuple[int, int]]:
        own = self._own(arm)
        bodies = [body for _, _, body in own]
        bounds = [bounding(body.shape) for body in bodies if not isinstance(body.shape, HalfSpace)]
        return self_pairs(arm.robot, [link for _, link, _ in own], bodies, bounds, arm.lower, arm.upper)

    def _add(self, body: Body, arm: int | None, link: int, name: str | None = None, carried: bool = False) -> int:
        shape = coal_shape(body.shape)
        centre, radius = np.zeros(3), inf
        if not isinstance(body.shape, HalfSpace):
            shape.computeLocalAABB()
            centre, radius = np.array(shape.aabb_center), float(shape.aabb_radius)
        self.solids.append(Solid(name or body.name, arm, link, carried, body.pose, shape, centre, radius))
        return len(self.solids) - 1

    # --- where it is --------------------------------------------------------------------------------------------------

    def place(self, joints: list[Floats], object_in_world: Floats) -> list[Floats]:
        """(4, 4) of every solid in the world for one configuration: joints (6,) per arm, object (4, 4)."""
        frames: list[list[Floats]] = []
        for arm, data, base, q in zip(self.cell.arms, self._data, self.bases, joints, strict=True):
            pin.forwardKinematics(pinocchio_model(arm.robot), data, q)
            frames.append([base, *(base @ data.oMi[i].homogeneous for i in range(1, arm.dof + 1))])
        placed = []
        for solid in self.solids:
            if solid.arm is not None:
                placed.append(frames[solid.arm][solid.link] @ solid.pose)
            else:
                placed.append(object_in_world @ solid.pose if solid.carried else solid.pose)
        return placed

    def nearest(self, places: list[Floats], below: dict[str, float]) -> dict[str, tuple[float, int, int]]:
        """Closest pair of every class, if closer than ``below`` (m, per class): (distance, index, index)."""
        centres = [pose[:3, :3] @ s.centre + pose[:3, 3] for pose, s in zip(places, self.solids, strict=True)]
        transforms: dict[int, Any] = {}
        found: dict[str, tuple[float, int, int]] = {}
        for kind, i, j in self.pairs:
            most = found[kind][0] if kind in found else below.get(kind, inf)
            first, second = self.solids[i], self.solids[j]
            apart = centres[i] - centres[j]
            if (apart @ apart) ** 0.5 - first.radius - second.radius >= most:  # the balls around them are farther
                continue
            for k in (i, j):
                if k not in transforms:
                    transforms[k] = _placed(places[k])
            distance = _distance(first.shape, transforms[i], second.shape, transforms[j])
            if distance < most:
                found[kind] = distance, i, j
        return found


def _placed(pose: Floats) -> Any:
    return coal.Transform3s(pose[:3, :3], pose[:3, 3])


def _distance(first: Any, first_pose: Any, second: Any, second_pose: Any) -> float:
    """Signed distance [m] as Coal gives it."""
    return float(coal.distance(first, first_pose, second, second_pose, _REQUEST, coal.DistanceResult()))


def _request() -> Any:
    request = coal.DistanceRequest()
    request.enable_signed_distance = True
    request.gjk_max_iterations = 512
    request.gjk_tolerance = 1e-9
    return request


_REQUEST = _request()
