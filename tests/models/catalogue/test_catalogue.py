"""What the catalogue says about its robots: the source's table, limits, references, provenance."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import ssik

from duocell.models.base.errors import UnknownRobot
from duocell.models.base.pose import rotation_x, rotation_z, transform
from duocell.models.catalogue import catalogue
from duocell.models.catalogue.reference import SINGULAR
from duocell.models.kinematics.kinematics import characteristic_length, conditioning, flange_poses

DATA = tomllib.loads((Path(catalogue.__file__).parent / "robots" / "arms.toml").read_text(encoding="utf-8"))
SHIPPED = [name for name in catalogue.names() if name != "puma560"]

# The digest of the source, section 1: α [°], a [mm], d [mm], range [°].
PUMA = np.array(
    [
        [-90, 0, 0, -160, 160],
        [0, 431.8, 149.1, -185, 45],
        [90, -20.3, 0, -45, 225],
        [-90, 0, 433.1, -110, 170],
        [90, 0, 0, -100, 100],
        [0, 0, 56.3, -266, 266],
    ]
)


def test_puma_moves_as_the_table_of_the_source_says() -> None:
    robot = catalogue.robot("puma560")
    for q in np.random.default_rng(0).uniform(-4.0, 4.0, (20, 6)):
        expected = np.eye(4)
        for (alpha, a, d, _, _), theta in zip(PUMA, q, strict=True):
            turn = transform(rotation_z(theta), [0.0, 0.0, d / 1000.0])
            expected = expected @ turn @ transform(rotation_x(np.radians(alpha)), [a / 1000.0, 0.0, 0.0])
        assert np.abs(flange_poses(robot, q)[0] - expected).max() < 1e-14


def test_puma_has_the_limits_and_the_mid_range_of_the_source() -> None:
    robot = catalogue.robot("puma560")
    assert np.allclose(np.degrees(robot.lower), PUMA[:, 3], rtol=0.0, atol=1e-12)
    assert np.allclose(np.degrees(robot.upper), PUMA[:, 4], rtol=0.0, atol=1e-12)
    assert np.allclose(np.degrees(robot.reference), PUMA[:, 3:].mean(axis=1), rtol=0.0, atol=1e-12)
    assert any("shoulder height" in note for note in robot.notes)
    assert robot.ssik_name is None


def test_catalogue_holds_the_sources_arm_and_all_of_ssik() -> None:
    shipped = {arm.name.removesuffix("_ik") for arm in ssik.list_arms()}
    assert set(catalogue.names()) == (shipped - {"puma560"}) | {"puma560", "puma560_ssik"}
    assert catalogue.names() == sorted(set(catalogue.names()))
    assert len(shipped) == 72


@pytest.mark.parametrize("name", SHIPPED)
def test_limits_are_those_of_ssik_and_open_joints_are_endless_on_record(name: str) -> None:
    robot = catalogue.robot(name)
    assert robot.ssik_name is not None
    theirs = ssik.Manipulator.from_prebuilt(robot.ssik_name).joint_limits
    opened = []
    for i, limit in enumerate(theirs):
        if limit is None:
            opened.append(i + 1)
        assert (robot.lower[i], robot.upper[i]) == (limit or (-np.inf, np.inf))
    own = DATA["arms"].get(name, {})
    assert own.get("endless", []) == opened
    if opened:
        assert any(own["endless_source"] in note for note in robot.notes)


@pytest.mark.parametrize("name", SHIPPED)
def test_reference_is_inside_the_limits_and_no_singularity(name: str) -> None:
    robot = catalogue.robot(name)
    assert np.all(robot.reference >= robot.lower)
    assert np.all(robot.reference <= robot.upper)
    value = conditioning(robot, np.eye(4), robot.reference, characteristic_length(robot))[0]
    assert value >= (SINGULAR if robot.reference_source == "mid-range" else 2.0 * SINGULAR)


@pytest.mark.parametrize("name", SHIPPED)
def test_every_arm_says_where_it_comes_from(name: str) -> None:
    robot = catalogue.robot(name)
    assert robot.name == name
    assert robot.maker in DATA["makers"].values()
    assert "ssik" in robot.source
    assert all((robot.title, robot.licence, robot.base_frame, robot.flange_frame, robot.reference_source))


@pytest.mark.parametrize("name", [name for name in SHIPPED if catalogue.robot(name).maker == "Universal Robots"])
def test_universal_robots_bend_elbow_and_second_wrist(name: str) -> None:
    robot = catalogue.robot(name)
    assert np.allclose(np.degrees(robot.reference), [0, -90, 90, -90, -90, 0])
    assert "elbow" in robot.reference_source
    assert any("180°" in note for note in robot.notes)


def test_licence_is_that_of_the_geometry_or_left_to_the_source() -> None:
    assert catalogue.robot("irb120").licence == "Apache-2.0"
    assert catalogue.robot("gp8").licence == "BSD-3-Clause"
    assert catalogue.robot("cr5").licence == "MIT"
    assert catalogue.robot("rizon10").licence == "see source"


def test_hand_written_data_name_only_arms_and_makers_that_exist() -> None:
    vendors = {arm.vendor for arm in ssik.list_arms()}
    assert set(DATA["arms"]) <= set(SHIPPED)
    assert set(DATA["makers"]) == vendors
    assert set(DATA["maker_notes"]) | set(DATA["references"]) <= vendors


def test_arm_is_loaded_once() -> None:
    assert catalogue.robot("gp8") is catalogue.robot("gp8")


def test_listing_names_loads_no_arm() -> None:
    code = (
        "import sys; from duocell.models.catalogue import catalogue; catalogue.names(); catalogue.robot('ur5e');"
        "print([m for m in sys.modules if m.startswith('ssik.prebuilt.') and m.endswith('_ik')])"
    )
    root = Path(catalogue.__file__).parents[3]
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True, timeout=60
    )
    assert result.stdout.strip() == "['ssik.prebuilt.universal_robots.ur5e_ik']"


def test_unknown_name_is_answered_with_near_ones() -> None:
    with pytest.raises(UnknownRobot, match="ur10e"):
        catalogue.robot("ur10")
    with pytest.raises(UnknownRobot, match="names are"):
        catalogue.robot("")


def test_limits_between_joints_are_read_in_degrees_and_the_catalogue_has_none() -> None:
    table = tomllib.loads("""linear_limits = [{coefficients = [0, 1, -1], degrees = [-90, 45], source = "manual"}]""")
    limits = catalogue.linear_limits_in(table["linear_limits"], ("a", "b", "c"))
    assert limits is not None
    assert limits.names == ("b - c",)
    np.testing.assert_allclose([limits.lower[0], limits.upper[0]], [-np.pi / 2, np.pi / 4])
    assert catalogue.linear_limits_in([], ("a", "b", "c")) is None
    assert all(catalogue.robot(name).linear_limits is None for name in catalogue.names())
