"""Reduced problems of one arm each, on a tilted line in front of the origin, and placements about it."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_z, transform
from duocell.models.catalogue.catalogue import robot
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import line
from duocell.models.robot.arm import Arm, BaseRegion, Interval, range_weights
from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.reduction.reduced import ReducedProblem, reduced_problem

STEP = 1e-6
"""Of finite differences."""


def _problem(name: str) -> ReducedProblem:
    """A tilted line of 30 cm in front of the origin, for any arm of about a metre."""
    chain = robot(name)
    start = transform(rotation_z(0.3), np.array([0.5, 0.1, 0.1]))
    end = transform(rotation_z(-0.4), np.array([0.6, 0.35, 0.2]))
    grasp = transform(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), np.array([-0.06, -0.01, -0.02]))
    side = Interval(-2.0, 2.0)
    arm = Arm(
        name,
        chain,
        np.eye(4),
        grasp,
        BaseRegion(side, side, side),
        chain.lower,
        chain.upper,
        chain.reference + 0.1,
        range_weights(chain.lower, chain.upper),
    )
    problem = reduced_problem(Cell(line(start, end, 6), (arm,)), arm)
    assert problem is not None
    return problem


PROBLEMS = {name: _problem(name) for name in ("puma560", "ur5e", "gp8")}


def _around(distance: float, bearing: float, z: float, yaw: float) -> Floats:
    """A base on a ring about the path."""
    return np.array([0.55 + distance * np.cos(bearing), 0.22 + distance * np.sin(bearing), z, yaw])


near = st.builds(_around, st.floats(0.3, 0.55), st.floats(-3.2, 3.2), st.floats(-0.1, 0.2), st.floats(-3.0, 3.0))
anywhere = st.builds(_around, st.floats(0.0, 2.0), st.floats(-3.2, 3.2), st.floats(-1.0, 1.0), st.just(0.0))
names = st.sampled_from(sorted(PROBLEMS))
postures = st.sampled_from(ALL_SIGNS)
