"""Bases that keep a coupling are never in boxes that are said not to hold any; far from it boxes are."""

from __future__ import annotations

from math import cos, sin

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.cell.coupling import Coupling, Direction, Distance, Mirror, Rail, SameHeight
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.pairs.couplings import untied
from duocell.optimizer.verification.scene import row_violation

ANGLE, POINT = 0.7, (0.3, -0.2)
ALONG, ACROSS = np.array([cos(ANGLE), sin(ANGLE)]), np.array([-sin(ANGLE), cos(ANGLE)])
COUPLINGS: tuple[Coupling, ...] = (
    SameHeight((0, 1)),
    Rail((0, 1), ANGLE),
    Rail((1, 0), ANGLE, POINT),
    Distance((0, 1), 0.5, 0.8),
    Direction((1, 0), ANGLE),
    Mirror((0, 1), POINT, ANGLE),
)


def _second(coupling: Coupling, first: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Two bases (3,) that keep a coupling, the first perhaps moved onto it."""
    far = rng.uniform(0.1, 1.0)
    match coupling:
        case SameHeight():
            return first, np.array([*rng.uniform(-1.0, 1.0, 2), first[2]])
        case Rail(point=point):
            if point is not None:
                first = np.array([*(np.array(point) + rng.uniform(-1.0, 1.0) * ALONG), first[2]])
            return first, first + far * np.array([*ALONG, 0.0])
        case Distance():
            turn = rng.uniform(0.0, 6.3)
            return first, first + rng.uniform(0.5, 0.8) * np.array([cos(turn), sin(turn), 0.0])
        case Direction():
            return first, first - far * np.array([*ALONG, 0.0])  # the first arm is the coupling's second
        case _:
            off = (first[:2] - POINT) @ ACROSS
            return first, np.array([*(first[:2] - 2.0 * off * ACROSS), first[2]])


@pytest.mark.parametrize("coupling", COUPLINGS, ids=lambda c: c.kind)
def test_boxes_around_bases_that_keep_it_are_kept(coupling: Coupling) -> None:
    rng = np.random.default_rng(3)
    for _ in range(300):
        first, second = _second(coupling, rng.uniform(-1.0, 1.0, 3), rng)
        yaws = (0.4, 2.0 * ANGLE - 0.4)
        assert row_violation(coupling.rows([(*first, yaws[0]), (*second, yaws[1])])) < 1e-9
        halves = 10.0 ** rng.uniform(-4.0, 0.0, (2, 3)) * rng.choice([0.0, 1.0], (2, 3), p=[0.2, 0.8])
        centres = np.stack([first, second]) + halves * rng.choice([-1.0, 0.3, 1.0], (2, 3))
        boxes = [Boxes(centres[k, None], halves[k, None], np.zeros(1, dtype=np.int64)) for k in (0, 1)]
        assert not untied((coupling,), (0, 1), boxes[0], boxes[1])[0]


@pytest.mark.parametrize("coupling", COUPLINGS, ids=lambda c: c.kind)
def test_small_boxes_off_it_are_lost(coupling: Coupling) -> None:
    rng, lost = np.random.default_rng(4), 0
    for _ in range(100):
        centres = rng.uniform(-1.0, 1.0, (2, 3))
        boxes = [Boxes(c[None], np.full((1, 3), 1e-4), np.zeros(1, dtype=np.int64)) for c in centres]
        gone = bool(untied((coupling,), (0, 1), boxes[0], boxes[1])[0])
        rows = coupling.rows([(*centres[0], 0.0), (*centres[1], 2.0 * ANGLE)])
        assert gone or row_violation(rows) < 4e-3
        lost += gone
    assert lost > 50
