"""The two acceptance cases, shaped after the source's examples: a straight line, and an arc of 900 mm radius."""

from __future__ import annotations

import numpy as np

from duocell.models.base.pose import rotation_x, rotation_z, transform
from duocell.models.catalogue.catalogue import robot
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import arc_through_center, line
from duocell.models.robot.arm import Arm, BaseRegion, Interval, range_weights

TURNED = rotation_z(-np.pi / 4)
MAIN_GRASP = transform([[0, 0, 1], [1, 0, 0], [0, 1, 0]], [-0.06, -0.015, -0.02])
FOLLOWER_GRASP = transform([[0, 0, -1], [1, 0, 0], [0, -1, 0]], [0.06, 0.015, 0.02])
UP_LEFT = np.radians([10.0, -22.5, 155.0, 30.0, 10.0, 10.0])
UP_RIGHT = np.radians([10.0, -157.0, 25.0, 30.0, 10.0, 10.0])
LOWER_BOUNDS = {"line": (68.13652501060423, 86.28850547298075), "arc": (91.28294588487083, 88.61351624703725)}
"""Proved by branch and bound: no base in the region scores less, whatever the posture."""
BEST_KNOWN = {"line": 155.20103566189445, "arc": 180.80046445417898}


def _cell(name: str) -> Cell:
    if name == "line":
        start, end = [0.7331344418400145, 0.3524090098774652, 0.1], [1.0948655581599856, 0.6975909901225348, 0.1]
        task = line(transform(TURNED, start), transform(TURNED, end), 10)
        box, references = (Interval(-0.286, 2.114), Interval(-0.675, 1.725)), (UP_LEFT, UP_LEFT)
    else:
        start, end = [0.12057713659400515, 0.65, 0.1], [0.45, 0.32057713659400515, 0.1]
        last = transform(TURNED @ rotation_x(-np.pi / 2), end)
        task = arc_through_center(transform(TURNED, start), last, [0.9, 1.1, 0.1], 10)
        side = 0.9275476178975979
        box, references = (Interval(-side, 2.4 - side), Interval(0.2 - side, 2.6 - side)), (UP_LEFT, UP_RIGHT)
    puma = robot("puma560")
    region = BaseRegion(*box, Interval(0.0, 0.0))
    weights = range_weights(puma.lower, puma.upper)
    arms = tuple(
        Arm(label, puma, np.eye(4), grasp, region, puma.lower, puma.upper, reference, weights)
        for label, grasp, reference in zip(("main", "follower"), (MAIN_GRASP, FOLLOWER_GRASP), references, strict=True)
    )
    return Cell(task, arms, name=name)


CELLS = {name: _cell(name) for name in ("line", "arc")}
