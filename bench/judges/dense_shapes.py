"""Shapes as Coal's geometries, for the judge that reads everything a second time."""

from __future__ import annotations

from typing import Any

import coal
import numpy as np

from duocell.models.geometry.shapes import Box, Capsule, Cylinder, HalfSpace, Shape, Sphere


def coal_shape(shape: Shape) -> Any:
    """Coal's geometry of a shape."""
    match shape:
        case Box(size=size):
            return coal.Box(*size)
        case Sphere(radius=radius):
            return coal.Sphere(radius)
        case Capsule(radius=radius, length=length):
            return coal.Capsule(radius, length)
        case Cylinder(radius=radius, length=length):
            return coal.Cylinder(radius, length)
        case HalfSpace():
            return coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
        case _:
            corners = coal.StdVec_Vec3s()
            for point in shape.points:
                corners.append(point)
            return coal.ConvexBase.convexHull(corners, True, "Qt")
