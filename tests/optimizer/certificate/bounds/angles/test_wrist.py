"""Turns of the wrist over boxes of any size: enclosures hold also where a cosine is 1 to rounding."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from optimizer.certificate.bounds.angles.wrist import combined


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
