"""Turns of the wrist over boxes of any size: enclosures hold also where a cosine is 1 to rounding."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from duocell.optimizer.certificate.bounds.angles.wrist import Wrist, _bend, combined, swing


@pytest.mark.parametrize("lean", [0.0, 0.3, -0.8, 1.0])
def test_two_turns_together_make_their_angle_however_small_they_are(lean: float) -> None:
    """Tiny turns add up as vectors; those that are not tiny are multiplied by SciPy."""
    aside = np.array([abs(lean), np.sqrt(1.0 - lean**2), 0.0])
    for size in 10.0 ** np.arange(-12.0, 0.5):
        one, other = 0.7 * size, 0.4 * size
        found = float(combined(np.array(one), np.array(other), lean))
        if size < 1e-5:
            expected = float(np.linalg.norm(one * np.array([1.0, 0.0, 0.0]) + other * aside))
        else:
            turned = Rotation.from_rotvec(one * np.array([1.0, 0.0, 0.0])) * Rotation.from_rotvec(other * aside)
            expected = float(turned.magnitude())
        assert found == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("slant", [0.3, 1.0, 1.5])
def test_the_bend_of_an_oblique_wrist_is_known_next_to_its_ends(slant: float) -> None:
    """Two equal slants: a is turned into axis 6 by 2 asin(sin(slant) sin(q/2)), however little axis 5 turns."""
    c, s = float(np.cos(slant)), float(np.sin(slant))
    wrist = Wrist(np.eye(3), np.eye(3), c, s, c, s, 0.0, 1)
    assert wrist.cone == pytest.approx((0.0, 2.0 * slant))
    for turn in 10.0 ** np.arange(-12.0, 0.5):
        theta = 2.0 * np.arcsin(s * np.sin(0.5 * turn))
        assert _bend(wrist, np.array(theta)) == pytest.approx(turn, rel=1e-9)


def test_directions_next_to_an_axis_are_moved_as_far_as_they_are_off_it() -> None:
    for tilt in 10.0 ** np.arange(-15.0, 0.0):
        assert float(swing(np.array(0.5), tilt)) == pytest.approx(2.0 * np.sin(0.25) * tilt, rel=tilt**2 + 1e-12)
    assert float(swing(np.array(4.0), 1.0)) >= np.pi * (1.0 - 1e-15)
