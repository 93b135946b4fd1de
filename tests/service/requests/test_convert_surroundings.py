"""From what a request says of a real cell to the objects of the models."""

import json
from math import inf, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from duocell.models.cell.coupling import Direction, Distance, Mirror, Rail, Rigid, SameHeight
from duocell.models.cell.floor import POINT
from duocell.models.cell.surroundings import Clearances
from duocell.models.geometry.shapes import Box, Capsule, Cylinder, HalfSpace, Sphere
from duocell.models.robot.arm import Interval
from duocell.optimizer.settings import ToleranceSettings
from duocell.service.common.issues import InvalidRequest
from duocell.service.library.library import Library
from duocell.service.library.user_mesh import UserMesh, mesh_document
from duocell.service.requests.accept import accept
from duocell.service.requests.convert import cell_of, joints_of, settings_of
from duocell.service.schemas.evaluate import EVALUATE_EXAMPLE, EvaluateRequest
from duocell.service.schemas.request import LayoutRequest
from duocell.service.settings import Limits
from duocell.service.validation import validate

Document = dict[str, Any]

AT = {"position": [1.0, 2.0, 3.0], "orientation": {"rpy": [0.0, 0.0, pi / 2]}}
BOX = {"type": "box", "size": [1.0, 2.0, 3.0]}
NOTHING = Clearances()
CONTACT = Clearances(0.0, 0.0, 0.0, 0.0, 0.0)


def cell(document: Document, library: Library | None = None) -> Any:
    return cell_of(validate(LayoutRequest, document), library)


@pytest.fixture
def library(tmp_path: Path) -> Library:
    """Holds two tetrahedra that are called "wedge"."""
    corners = np.vstack([np.zeros(3), np.eye(3)])
    bounds = np.array([np.zeros(3), np.full(3, 2.0)])
    kept = Library(tmp_path)
    wedge = UserMesh("wedge", "wedge", "stl", 484, 8, bounds, (corners, corners + 1.0), "")
    assert kept.mesh_store.put("wedge", mesh_document(wedge))
    return kept


def test_without_anything_a_cell_is_what_it_was(example: Document) -> None:
    made = cell(example)
    around = made.surroundings
    assert not made.coupled
    assert around.obstacles == ()
    assert around.part is None
    assert around.clearances == NOTHING
    assert all(np.array_equal(arm.mount, np.eye(3)) for arm in made.arms)
    assert all(around.footprint(arm.name) is POINT for arm in made.arms)


@pytest.mark.parametrize(
    ("shape", "kind", "numbers"),
    [
        (BOX, Box, {"size": [1.0, 2.0, 3.0]}),
        ({"type": "sphere", "radius": 0.1}, Sphere, {"radius": 0.1}),
        ({"type": "cylinder", "radius": 0.1, "length": 0.4}, Cylinder, {"radius": 0.1, "length": 0.4}),
        ({"type": "capsule", "radius": 0.1, "length": 0.4}, Capsule, {"radius": 0.1, "length": 0.4}),
        ({"type": "half_space"}, HalfSpace, {}),
    ],
)
def test_every_shape(example: Document, shape: Document, kind: type, numbers: Document) -> None:
    example["obstacles"] = [{"name": "thing", "pose": AT, "shape": shape}]
    (body,) = cell(example).surroundings.obstacles
    assert body.name == "thing"
    np.testing.assert_allclose(body.pose[:3, 3], [1.0, 2.0, 3.0])
    np.testing.assert_allclose(body.pose[:3, 0], [0.0, 1.0, 0.0], atol=1e-12)
    assert isinstance(body.shape, kind)
    for name, value in numbers.items():
        np.testing.assert_array_equal(getattr(body.shape, name), value)


def test_a_mesh_becomes_its_pieces_with_names_of_their_own(example: Document, library: Library) -> None:
    mesh = {"type": "mesh", "id": "wedge", "scale": 0.5}
    example["obstacles"] = [{"name": "jig", "pose": AT, "shape": mesh}, {"name": "jig piece 2", "shape": BOX}]
    example["part"] = {"shapes": [{"shape": mesh}, {"shape": BOX}]}
    example["arms"][0]["tool_shapes"] = [{"shape": mesh}]
    around = cell(example, library).surroundings
    assert [body.name for body in around.obstacles] == ["jig", "jig piece 2'", "jig piece 2"]
    first, second = (body.shape for body in around.obstacles[:2])
    np.testing.assert_allclose(second.points.min(axis=0), first.points.min(axis=0) + 0.5)
    assert [body.name for body in around.part.bodies] == ["part 1", "part 2", "part 3"]
    assert len(around.of("main").tool) == 2
    example["obstacles"][0]["shape"] = {"type": "mesh", "id": "other"}
    with pytest.raises(InvalidRequest) as caught:
        cell(example, library)
    assert [issue.pointer for issue in caught.value.issues] == ["/obstacles/0/shape/id"]


def test_a_part_with_its_grasp_zone(example: Document) -> None:
    example["part"] = {"shapes": [{"pose": AT, "shape": BOX}], "grasp_zone": 0.15}
    part = cell(example).surroundings.part
    assert part.grasp_zone == 0.15
    assert [body.name for body in part.bodies] == ["part"]


def test_what_an_arm_brings_along(example: Document) -> None:
    example["arms"][0] |= {
        "pedestal": {"height": 0.6, "foot": -0.6, "footprint": {"size": [0.4, 0.2]}},
        "tool_shapes": [{"pose": AT, "shape": {"type": "sphere", "radius": 0.1}}],
    }
    example["arms"][1] |= {
        "pedestal": {"height": 0.5, "foot": -0.5, "footprint": {"radius": 0.3}},
        "footprint": {"polygon": [[-0.2, -0.2], [0.3, 0.0], [-0.2, 0.2]]},
    }
    around = cell(example).surroundings
    main, follower = around.of("main"), around.of("follower")
    np.testing.assert_array_equal(main.pedestal.body.shape.size, [0.4, 0.2, 0.6])
    np.testing.assert_array_equal(main.tool[0].pose[:3, 3], [1.0, 2.0, 3.0])
    assert around.footprint("main") is main.pedestal.footprint
    assert follower.pedestal.footprint.radius == 0.3
    assert len(around.footprint("follower").corners) == 3


@pytest.mark.parametrize(
    ("mount", "up", "ahead"),
    [
        ({}, [0, 0, 1], [1, 0, 0]),
        ({"roll": pi}, [0, 0, -1], [1, 0, 0]),  # from the ceiling
        ({"pitch": pi / 2}, [1, 0, 0], [0, 0, -1]),  # on a wall that faces along x
        ({"roll": -pi / 2}, [0, 1, 0], [1, 0, 0]),  # on a wall that faces along y
        ({"roll": pi / 2, "pitch": pi / 2}, [0, -1, 0], [0, 0, -1]),  # the roll first
    ],
)
def test_mounts(example: Document, mount: Document, up: list[float], ahead: list[float]) -> None:
    example["arms"][0]["mount"] = mount
    arm = cell(example).arms[0]
    np.testing.assert_allclose(arm.mount[:, 2], up, atol=1e-12)
    np.testing.assert_allclose(arm.mount[:, 0], ahead, atol=1e-12)
    turned = arm.base_in_world(np.zeros(3), 0.5)[:3, :3]
    np.testing.assert_allclose(turned[:, 2], up, atol=1e-12)  # the yaw turns about the base's own z
    np.testing.assert_allclose(turned[:, 0] @ arm.mount[:, 0], np.cos(0.5))


def test_a_floor(example: Document) -> None:
    room, pit = [[0, 0], [4, 0], [4, 3], [0, 3]], [[1, 1], [2, 1], [2, 2]]
    example["floor"] = {"allowed": room, "forbidden": [pit], "margin": 0.1}
    floor = cell(example).surroundings.floor
    distances = floor.signed_distance([[0.5, 0.5], [2.5, 1.0], [-1.0, 1.0]])
    np.testing.assert_allclose(distances, [0.4, 0.4, -1.1], atol=1e-9)
    assert cell(example).coupled


@pytest.mark.parametrize(
    ("coupling", "expected"),
    [
        ({"type": "same_z"}, SameHeight((1, 0))),
        ({"type": "distance"}, Distance((1, 0), 0.0, inf)),
        ({"type": "distance", "minimum": 1.0, "maximum": 2.0}, Distance((1, 0), 1.0, 2.0)),
        ({"type": "direction", "angle": 0.5}, Direction((1, 0), 0.5)),
        ({"type": "mirror", "angle": 0.5, "point": [1.0, 2.0]}, Mirror((1, 0), (1.0, 2.0), 0.5)),
        ({"type": "rail", "angle": 0.5}, Rail((1, 0), 0.5)),
        (
            {"type": "rigid", "x": 0.8, "y": [-0.1, 0.1], "yaw": 3.0},
            Rigid((1, 0), Interval(0.8, 0.8), Interval(-0.1, 0.1), Interval(0.0, 0.0), Interval(3.0, 3.0)),
        ),
        ({"type": "rail", "angle": 0.5, "point": [1.0, 2.0]}, Rail((1, 0), 0.5, (1.0, 2.0))),
    ],
)
def test_couplings(example: Document, coupling: Document, expected: Any) -> None:
    example["coupling"] = [{"arms": ["follower", "main"], **coupling}]
    assert cell(example).couplings == (expected,)


def test_one_stand_of_a_hanging_arm_is_refused(example: Document) -> None:
    example["arms"][1]["mount"] = {"roll": pi}
    example["coupling"] = [{"type": "rigid", "arms": ["main", "follower"], "x": 1.0, "y": 0.0}]
    with pytest.raises(InvalidRequest) as caught:
        cell(example)
    assert [issue.pointer for issue in caught.value.issues] == ["/coupling/0/arms/1"]


# --- clearances -------------------------------------------------------------------------------------------------------

TABLE: Document = {"obstacles": [{"name": "table", "shape": BOX}]}
PART: Document = {"part": {"shapes": [{"shape": BOX}]}}


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({}, NOTHING),
        (TABLE, Clearances(arm_arm=0.0, arm_obstacle=0.0, self_collision=0.0)),
        (PART, Clearances(arm_arm=0.0, arm_part=0.0, self_collision=0.0)),
        (TABLE | PART, CONTACT),
        ({"clearance": {}}, Clearances(arm_arm=0.0, self_collision=0.0)),
        (TABLE | {"clearance": {"arm_obstacle": 0.03}}, Clearances(0.0, None, 0.03, None, 0.0)),
        (TABLE | PART | {"clearance": {"self": None, "arm_arm": 0.05}}, Clearances(0.05, 0.0, 0.0, 0.0, None)),
        (TABLE | {"clearance": dict.fromkeys(["arm_arm", "arm_obstacle", "self"])}, NOTHING),
        ({"clearance": {"arm_part": 0.1, "arm_arm": None, "self": None}}, NOTHING),  # there is no part
    ],
)
def test_contact_is_forbidden_as_soon_as_bodies_are_described(
    example: Document, given: Document, expected: Clearances
) -> None:
    assert cell(example | given).surroundings.clearances == expected


@pytest.mark.parametrize("field", ["tool_shapes", "pedestal"])
def test_a_tool_or_a_pedestal_is_a_body_too(example: Document, field: str) -> None:
    described = {"tool_shapes": [{"shape": BOX}], "pedestal": {"foot": -1.0, "footprint": {"radius": 0.2}}}
    example["arms"][1][field] = described[field]
    assert cell(example).surroundings.clearances == Clearances(arm_arm=0.0, self_collision=0.0)


def test_a_lone_arm_has_no_other_to_keep_away_from(example: Document) -> None:
    example["arms"] = example["arms"][:1]
    assert cell(example | TABLE).surroundings.clearances == Clearances(arm_obstacle=0.0, self_collision=0.0)


# --- settings, limits, evaluations ------------------------------------------------------------------------------------


def test_settings_of_the_search(example: Document) -> None:
    plain = settings_of(validate(LayoutRequest, example), 7.0)
    assert (plain.alternatives, plain.tolerance, plain.explain) == (0, None, False)
    example |= {"alternatives": 3, "tolerance": {"position": 0.01}, "explain": True}
    asked = settings_of(validate(LayoutRequest, example), 7.0)
    assert (asked.alternatives, asked.explain) == (3, True)
    assert asked.tolerance == ToleranceSettings(0.01, ToleranceSettings().angle)
    assert accept(json.dumps(example).encode(), Limits()).runs == 2


def test_amounts_are_settings(example: Document) -> None:
    square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    solid = {"shape": BOX}
    example |= {
        "floor": {"forbidden": [square, square]},
        "coupling": [{"type": "same_z", "arms": ["main", "follower"]}] * 2,
    }
    example |= {"obstacles": [{"name": str(i), **solid} for i in range(2)], "part": {"shapes": [solid, solid]}}
    example["arms"][1] |= {"tool_shapes": [solid, solid], "pedestal": {"foot": -1, "footprint": {"polygon": square}}}
    body = json.dumps(example).encode()
    accept(body, Limits())
    for limits, pointers in (
        (Limits(max_obstacles=1), {"/obstacles"}),
        (Limits(max_shapes=1), {"/part/shapes", "/arms/1/tool_shapes"}),
        (Limits(max_polygons=1), {"/floor/forbidden"}),
        (Limits(max_corners=3), {"/floor/forbidden/0", "/floor/forbidden/1", "/arms/1/pedestal/footprint/polygon"}),
        (Limits(max_couplings=1), {"/coupling"}),
    ):
        with pytest.raises(InvalidRequest) as caught:
            accept(body, limits)
        assert caught.value.code == "too-large"
        assert {issue.pointer for issue in caught.value.issues} == pointers


def test_an_evaluation_is_a_cell_with_fixed_bases_and_perhaps_joints() -> None:
    rows = [[0.1 * pose] * 6 for pose in range(10)]
    document = json.loads(json.dumps(EVALUATE_EXAMPLE))
    document["arms"][1]["joints"] = rows
    request = validate(EvaluateRequest, document)
    made = cell_of(request)
    assert all(made.arms[0].base.bounds[:, 0] == made.arms[0].base.bounds[:, 1])
    first, second = joints_of(request, made)
    assert first is None
    np.testing.assert_array_equal(second, rows)


# --- pedestals and the heights of bases -------------------------------------------------------------------------------

PLATE = {"footprint": {"radius": 0.2}}


def with_pedestal(example: Document, z: float | list[float], **pedestal: object) -> Document:
    example["arms"][0] |= {"pedestal": PLATE | pedestal, "base": example["arms"][0]["base"] | {"z": z}}
    return example


@pytest.mark.parametrize(
    ("z", "given", "height", "foot"),
    [
        (0.35, {}, 0.35, 0.0),
        ([0.2, 0.5], {}, 0.5, 0.0),  # at most
        ([0.4, 0.5], {"foot": 0.3}, 0.2, 0.3),
        (0.35, {"height": 0.35}, 0.35, None),
        (0.35, {"height": 0.3505}, 0.3505, None),  # rounded
        (0.8, {"height": 0.5, "foot": 0.3}, 0.5, None),
    ],
)
def test_a_pedestal_reaches_from_its_foot_to_the_base(
    example: Document, z: float | list[float], given: Document, height: float, foot: float | None
) -> None:
    pedestal = cell(with_pedestal(example, z, **given)).surroundings.of("main").pedestal
    assert pedestal.height == pytest.approx(height)
    assert pedestal.foot == foot


@pytest.mark.parametrize(
    ("z", "given", "mount", "field", "words"),
    [
        (0.829, {"height": 0.5}, None, "height", "a foot of 0.329 m"),
        (0.5, {"height": 0.829}, None, "height", "as high as the base stands"),
        (0.5, {"height": 500}, None, "height", "Did you mean 0.5 m (500 mm)?"),
        ([0.1, 0.9], {"height": 0.5}, None, "height", "Fix z at 0.5 m"),
        ([0.6, 0.9], {"height": 0.5}, None, "height", "may stand at z = 0.6 to 0.9 m"),
        ([0.0, 0.9], {}, None, "height", "as low as z = 0 m"),
        (0.3, {"foot": 0.3}, None, "height", "stands at z = 0.3 m"),
        (2.0, {}, {"roll": pi}, "height", "hangs or leans"),
        (2.0, {"height": 0.3, "foot": 1.0}, {"roll": pi}, "foot", "hangs or leans"),
    ],
)
def test_a_pedestal_that_does_not_fit_its_base_is_refused_with_what_would(
    example: Document, z: float | list[float], given: Document, mount: Document | None, field: str, words: str
) -> None:
    document = with_pedestal(example, z, **given)
    if mount is not None:
        document["arms"][0]["mount"] = mount
    with pytest.raises(InvalidRequest) as refused:
        cell(document)
    (issue,) = refused.value.issues
    assert issue.pointer == f"/arms/0/pedestal/{field}"
    assert words in issue.detail


def test_an_obstacle_that_is_wider_below_the_foot_is_refused(example: Document) -> None:
    ball = {"name": "ball", "pose": {"position": [3.0, 3.0, -0.2], "orientation": {"rpy": [0, 0, 0]}}}
    document = with_pedestal(example, [0.2, 0.5]) | {"obstacles": [ball | {"shape": {"type": "sphere", "radius": 0.5}}]}
    with pytest.raises(InvalidRequest) as refused:
        cell(document)
    (issue,) = refused.value.issues
    assert issue.pointer == "/obstacles"
    assert "'ball' goes through z = 0 m" in issue.detail
