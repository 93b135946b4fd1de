"""A slow second opinion on a path: fine even steps, Pinocchio and Coal alone, every pair at every step."""

from __future__ import annotations

from itertools import pairwise

import coal
import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation, Slerp

from duocell.models.base.arrays import Floats
from duocell.models.collision.collision import CollisionModel
from duocell.models.geometry.shapes import Box, Capsule, Cylinder, HalfSpace, Shape, Sphere
from duocell.models.kinematics.kinematics import FLANGE, pinocchio_model
from duocell.models.robot.arm import Arm
from tests.support.given.cells import Scene


def dense_minima(scene: Scene, model: CollisionModel, steps: int) -> dict[str, float]:
    """Smallest distance of each class over ``steps`` even steps from each pose to the next."""
    objects, joints = dense_path(scene, steps)
    return _minima(scene, model, objects, joints)


def dense_path(scene: Scene, steps: int) -> tuple[list[Floats], list[Floats]]:
    """Object poses, and per arm the joints, over ``steps`` even steps from each pose to the next."""
    poses = scene.cell.task.poses
    objects = []
    for start, end in pairwise(poses):
        shares = np.arange(steps) / steps
        turns = Slerp([0, 1], Rotation.from_matrix([start[:3, :3], end[:3, :3]]))(shares).as_matrix()
        for share, turn in zip(shares, turns, strict=True):
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = turn, (1 - share) * start[:3, 3] + share * end[:3, 3]
            objects.append(pose)
    objects.append(poses[-1])
    joints = []
    for arm, base, q in zip(scene.cell.arms, scene.bases, scene.joints, strict=True):
        rows, current = [], q[0].copy()
        for k, pose in enumerate(objects):
            if k % steps == 0:
                assert np.max(np.abs(current - q[k // steps])) < 0.3  # no other branch
                current = q[k // steps].copy()
            current = _newton(arm, np.linalg.inv(base) @ pose @ arm.grasp @ np.linalg.inv(arm.tool), current)
            rows.append(current)
        joints.append(np.array(rows))
    return objects, joints


def _newton(arm: Arm, target: Floats, q: Floats) -> Floats:
    model = pinocchio_model(arm.robot)
    data, frame, goal = model.createData(), model.getFrameId(FLANGE), pin.SE3(target)
    for _ in range(20):
        pin.framesForwardKinematics(model, data, q)
        error = pin.log6(data.oMf[frame].actInv(goal)).vector
        if np.linalg.norm(error) < 1e-10:
            break
        jacobian = pin.computeFrameJacobian(model, data, q, frame, pin.ReferenceFrame.LOCAL)
        q = q + np.linalg.pinv(jacobian) @ error
    return q


def _minima(scene: Scene, model: CollisionModel, objects: list[Floats], joints: list[Floats]) -> dict[str, float]:
    b = model.bodies
    geometries = [_geometry(body.shape) for body in b.bodies]
    counted = model.configure(scene.bases, [q[:1] for q in joints], np.array(objects[:1])).counted
    request = coal.DistanceRequest()
    request.enable_signed_distance = True
    minima: dict[str, float] = {}
    for k, pose in enumerate(objects):
        frames = [_frames(arm, base, q[k]) for arm, base, q in zip(scene.cell.arms, scene.bases, joints, strict=True)]
        places = []
        for owner, body in zip(b.owners, b.bodies, strict=True):
            if owner.arm is not None and owner.link is not None:
                frame = frames[owner.arm][owner.link]
            else:
                frame = pose if owner.part else np.eye(4)
            placed = frame @ body.pose
            places.append(coal.Transform3s(placed[:3, :3], placed[:3, 3]))
        for i, j, kind in zip(b.first[counted], b.second[counted], np.array(b.kinds)[counted], strict=True):
            distance = coal.distance(geometries[i], places[i], geometries[j], places[j], request, coal.DistanceResult())
            minima[str(kind)] = min(minima.get(str(kind), np.inf), distance)
    return minima


def _frames(arm: Arm, base: Floats, q: Floats) -> list[Floats]:
    model = pinocchio_model(arm.robot)
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    return [base] + [base @ data.oMi[i].homogeneous for i in range(1, arm.dof + 1)]


def _geometry(shape: Shape) -> coal.CollisionGeometry:
    if isinstance(shape, Box):
        return coal.Box(*shape.size)
    if isinstance(shape, Sphere):
        return coal.Sphere(shape.radius)
    if isinstance(shape, Capsule):
        return coal.Capsule(shape.radius, shape.length)
    if isinstance(shape, Cylinder):
        return coal.Cylinder(shape.radius, shape.length)
    if isinstance(shape, HalfSpace):
        return coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
    points = coal.StdVec_Vec3s()
    for point in shape.points:
        points.append(point)
    return coal.ConvexBase.convexHull(points, True, "Qt")
