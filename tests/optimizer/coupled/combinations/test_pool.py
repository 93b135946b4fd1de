"""Candidates among their surroundings: where the best ones all stand in something, and how much layouts violate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.cell.coupling import Distance
from duocell.models.cell.surroundings import PairClass
from duocell.models.geometry.shapes import Body, Capsule
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.optimize import optimize
from duocell.optimizer.verification.scene import Scene
from tests.support.given.blocked import carried, halves, one_arm
from tests.support.given.cells import beam_pair
from tests.support.present import present


def test_a_place_is_found_where_all_the_best_ones_are_taken() -> None:
    """A platform covers the ground of the four hundred best candidates and far beyond; the other side is free."""
    _, right = halves()
    layout = optimize(one_arm(task=carried(3), obstacles=(right,)))
    assert layout.usable
    assert layout.placements[0].position[1] > 0.1


def test_violations_of_layouts_are_those_of_the_nearest_pairs() -> None:
    """Many layouts at once against each by itself: the closest pair of every class, at every pose."""
    made = beam_pair(count=3, shift=(0.2, 0.0, 0.05))
    post = Body("post", np.eye(4), Capsule(0.05, 2.0))
    around = replace(made.surroundings, obstacles=(*made.surroundings.obstacles, post))
    scene = Scene.of(replace(made.cell, surroundings=around, couplings=(Distance((0, 1), 0.0),)))
    assert scene.model is not None
    rng, layouts, expected = np.random.default_rng(3), [], []
    for _ in range(12):
        points = []
        for base, q in zip(made.bases, made.joints, strict=True):
            yaw = float(np.arctan2(base[1, 0], base[0, 0]))
            points.append(
                ArmSolution(base[:3, 3] + rng.uniform(-0.3, 0.3, 3), yaw, q + rng.uniform(-0.5, 0.5, q.shape))
            )
        bases, violation = scene.bases(points), 0.0
        for k, pose in enumerate(made.cell.task.poses):
            for kind, contact in scene.model.contacts(bases, [p.joints[k] for p in points], pose).items():
                if kind is not PairClass.PART_OBSTACLE:
                    violation = max(violation, present(around.clearances.required(kind)) - contact.distance)
        layouts.append(points)
        expected.append(violation)
    assert scene.contact_violations(layouts) == pytest.approx(expected, abs=1e-6)
    assert min(expected) < max(expected)
