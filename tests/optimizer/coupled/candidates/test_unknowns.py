"""What couplings leave free: samples and moves keep the couplings, and turn with the world."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.pose import rotation_z, transform
from duocell.models.cell.coupling import Coupling, Direction, Mirror, Rail, SameHeight
from duocell.optimizer.coupled.candidates.unknowns import TiedUnknowns
from duocell.optimizer.coupled.combinations.project_positions import tie_violations
from tests.support.given.cells import beam_pair

BOXES = np.array([[[-1.0, 0.5], [-0.8, 0.9], [0.0, 0.4]], [[-0.6, 1.2], [-0.9, 0.8], [0.1, 0.5]]])
TIES = [
    (SameHeight((0, 1)),),
    (Mirror((0, 1), (0.1, 0.0), 1.0),),
    (Rail((0, 1), 0.4),),
    (Rail((1, 0), 0.4, (0.0, 0.1)),),
    (Direction((0, 1), 0.3), SameHeight((0, 1))),
]


@pytest.mark.parametrize("ties", TIES, ids=lambda ties: "+".join(tie.kind for tie in ties))
def test_samples_and_moves_keep_what_is_tied(ties: tuple[Coupling, ...]) -> None:
    cell = replace(beam_pair(count=3).cell, couplings=ties)
    unknowns = TiedUnknowns.of(cell, BOXES)
    assert not unknowns.empty
    samples = unknowns.sampled(500, 0)
    seen = 0
    for own, box in zip(samples, BOXES, strict=True):
        assert np.all(own.positions >= box[:, 0] - 1e-9)
        assert np.all(own.positions <= box[:, 1] + 1e-9)
    for group in np.intersect1d(samples[0].groups, samples[1].groups)[:40]:
        one, other = (own.positions[own.groups == group][0] for own in samples)
        for move in np.concatenate([np.zeros((1, 2, 3)), 0.1 * unknowns.moves()]):
            placed = [np.append(p + d, 0.3)[:, None] for p, d in zip((one, other), move, strict=True)]
            violations = tie_violations(ties, placed)[0]
            held = [k for k, label in enumerate(_labels(ties)) if "yaw" not in label and "side" not in label]
            assert np.max(np.abs(violations[held])) < 1e-9
            seen += 1
    assert seen > 10


def _labels(ties: tuple[Coupling, ...]) -> list[str]:
    return [label for tie in ties for label in tie.rows([np.zeros(4), np.zeros(4)]).labels]


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_samples_turn_and_shift_with_the_world(quarters: int) -> None:
    cell = replace(beam_pair(count=3).cell, couplings=(Rail((0, 1), 0.4),))
    turn = np.round(rotation_z(quarters * np.pi / 2))
    way = np.array([3.0, -7.0, 0.0])
    moved = transform(turn, way)
    corners = np.stack([BOXES[..., 0], BOXES[..., 1]], axis=-2) @ turn.T + way
    boxes = np.stack([corners.min(axis=1), corners.max(axis=1)], axis=-1)
    task = replace(cell.task, poses=moved @ cell.task.poses)
    turned = replace(cell, task=task, couplings=(Rail((0, 1), 0.4 + quarters * np.pi / 2),))
    before, after = (TiedUnknowns.of(c, b).sampled(300, 0) for c, b in ((cell, BOXES), (turned, boxes)))
    for one, other in zip(before, after, strict=True):
        assert np.array_equal(one.groups, other.groups)
        assert np.allclose(one.positions @ turn.T + way, other.positions, atol=1e-8)
