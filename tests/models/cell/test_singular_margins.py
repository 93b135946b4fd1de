"""The terms of a margin change their signs where the distance to the singular set is the margin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.kept import KEPT
from duocell.models.cell.singular_margins import ELBOW, margin_terms, margins_along, margins_at_poses
from duocell.models.robot.arm import SINGULAR_WRIST
from tests.support.given.arms import form_of, make_arm


@pytest.mark.parametrize("name", ["puma560", "ur10e"])
@pytest.mark.parametrize("turn", [0.0, np.pi, 2.0 * np.pi])
def test_elbow_and_wrist_keep_their_margins(name: str, turn: float) -> None:
    arm = make_arm(name)
    form = form_of(arm.robot)
    straight = -form.turns[2] * form.planar.elbow_angle + turn
    for joint, zero, margin in ((2, straight, ELBOW), (4, form.wrist_zero + turn, SINGULAR_WRIST)):
        for side in (1.0, -1.0):
            for share, kept in ((1.001, True), (1.0 - 0.5 * KEPT / margin, True), (0.99, False), (0.0, False)):
                q = np.array([0.3, 0.4, straight + 1.0, 0.5, form.wrist_zero + 1.0, 0.6])
                q[joint] = zero + side * share * margin
                assert bool(np.all(margin_terms(arm, q) >= 0.0)) == kept


def test_where_singularities_are_allowed_the_wrist_needs_no_margin() -> None:
    arm = make_arm("puma560")
    allowed = replace(arm, avoid_singularities=False)
    form = form_of(arm.robot)
    q = np.array([0.0, 0.4, 0.5, 0.0, form.wrist_zero, 0.0])
    assert np.any(margin_terms(arm, q) < 0.0)
    assert np.all(margin_terms(allowed, q) >= 0.0)
    assert (margins_along(allowed).wrist, margins_at_poses(allowed).wrist) == (0.0, 0.0)
    assert (margins_at_poses(arm).elbow, margins_at_poses(arm).wrist) == (0.0, SINGULAR_WRIST)
