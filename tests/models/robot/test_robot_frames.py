"""Flanges and mounting faces of the catalogue, against what the chains themselves say."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidInput
from duocell.models.catalogue import catalogue
from duocell.models.kinematics.chain import Chain, chain_of
from duocell.models.robot.robot_frames import ISO_9787

NOT_ALONG_THE_LAST_AXIS = {"openarm_left", "openarm_right", "r1pro_left", "r1pro_right"}
"""Their last joint bends the wrist: the hand continues across its axis."""
UNKNOWN_FACE = {"openarm_left", "openarm_right", "puma560", "puma560_ssik", "r1pro_left", "r1pro_right", "yam"}
SHORT = {"gp8": 0.080, "hc10": 0.130, "kr210_r2700": 0.215, "j2s7s300": 0.160}
"""m by which the description's last frame lies inside the flange, by the makers' own figures or descriptions."""


@pytest.mark.parametrize("name", catalogue.names())
def test_z_points_out_of_the_flange(name: str) -> None:
    """Along the last axis, away from the rest of the arm."""
    robot = catalogue.robot(name)
    chain = chain_of(robot)
    flange = chain.home @ robot.flange()
    np.testing.assert_allclose(flange[:3, :3].T @ flange[:3, :3], np.eye(3), atol=1e-12)
    assert np.linalg.det(flange[:3, :3]) == pytest.approx(1.0)
    out = flange[:3, 2]
    assert abs(out @ chain.axes[-1]) == pytest.approx(0.0 if name in NOT_ALONG_THE_LAST_AXIS else 1.0, abs=1e-6)
    if name in NOT_ALONG_THE_LAST_AXIS:
        np.testing.assert_allclose(out, [0.0, 0.0, -1.0], atol=1e-12)  # these arms hang
        return
    wrist = _wrist(chain)
    assert out @ (flange[:3, 3] - wrist) > 0.0 or np.allclose(flange[:3, 3], wrist, atol=1e-6)


def _wrist(chain: Chain) -> Floats:
    """The point of the last axis but one that is nearest to the last axis: a flange lies beyond it."""
    axis, point, before, start = chain.axes[-1], chain.points[-1], chain.axes[-2], chain.points[-2]
    across = before - (before @ axis) * axis
    away = point - start
    nearest: Floats = start + (away @ across) / max(across @ across, 1e-12) * before
    return nearest


@pytest.mark.parametrize(("name", "length"), SHORT.items())
def test_descriptions_that_end_inside_are_lengthened(name: str, length: float) -> None:
    assert np.linalg.norm(catalogue.robot(name).flange()[:3, 3]) == pytest.approx(length)


@pytest.mark.parametrize("name", catalogue.names())
def test_frames_have_names_and_sources(name: str) -> None:
    robot = catalogue.robot(name)
    assert robot.flange_names == (ISO_9787, robot.flange_frame)
    np.testing.assert_array_equal(robot.flange(ISO_9787), robot.flange())
    np.testing.assert_array_equal(robot.flange(robot.flange_frame), np.eye(4))
    assert all(frame.source for frame in robot.flanges)
    assert (robot.mounting_face is None) == (name in UNKNOWN_FACE)
    if robot.mounting_face is not None:
        assert robot.mounting_face.source
        assert robot.mounting_face.pose[2, 3] <= 0.0  # the base frame never lies below the floor


def test_most_flanges_are_confirmed_by_a_second_source() -> None:
    checked = [n for n in catalogue.names() if catalogue.robot(n).flanges[0].checked]
    assert len(checked) >= 53


def test_another_name_is_refused_with_those_there_are() -> None:
    with pytest.raises(InvalidInput, match="iso9787 and link_6"):
        catalogue.robot("irb120").flange("tool0")
