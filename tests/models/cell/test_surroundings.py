"""What a cell holds: refusals, pedestals, clearances."""

from __future__ import annotations

import pickle
from collections.abc import Callable

import numpy as np
import pytest

from duocell.models.base.errors import InvalidInput
from duocell.models.cell.floor import POINT, Footprint
from duocell.models.cell.surroundings import Clearances, Equipment, PairClass, Part, Pedestal, Surroundings
from duocell.models.geometry.shapes import Body, Box, ConvexHull, Cylinder, Shape, Sphere
from tests.support.given.solids import FLOOR, support

BALL = Body("ball", np.eye(4), Sphere(0.1))


@pytest.mark.parametrize(
    ("make", "pointer"),
    [
        (lambda: Part((BALL,), -0.1), "/grasp_zone"),
        (lambda: Part((BALL,), np.nan), "/grasp_zone"),
        (lambda: Part((BALL, FLOOR)), "/bodies/1/shape"),
        (lambda: Pedestal(0.0, Footprint.disc(0.1)), "/height"),
        (lambda: Pedestal(1.0, Footprint.disc(0.0)), "/footprint"),
        (lambda: Clearances(arm_arm=-0.01), "/arm_arm"),
        (lambda: Clearances(self_collision=np.inf), "/self"),
        (lambda: Equipment(tool=(FLOOR,)), "/tool/0/shape"),
        (lambda: Surroundings(obstacles=(BALL, FLOOR, BALL)), "/obstacles/2/name"),
    ],
)
def test_refused_with_a_pointer(make: Callable[[], object], pointer: str) -> None:
    with pytest.raises(InvalidInput) as error:
        make()
    assert error.value.pointer == pointer


@pytest.mark.parametrize(
    ("footprint", "kind"),
    [
        (Footprint.disc(0.2), Cylinder),
        (Footprint.rectangle(0.4, 0.6), Box),
        (Footprint.polygon([[0, 0], [1, 0], [0, 1]]), ConvexHull),
        (Footprint(np.array([[-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.2, 0.2]]), 0.05), ConvexHull),
    ],
)
def test_a_pedestal_stands_under_the_base_over_its_whole_footprint(footprint: Footprint, kind: type[Shape]) -> None:
    body = Pedestal(0.7, footprint).body
    assert isinstance(body.shape, kind)
    up = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    assert support(body.shape, body.pose, up) == pytest.approx([0.0, 0.7])
    angles = np.linspace(0.0, 6.0, 25)
    aside = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(25)])
    needed = np.max(aside[:, :2] @ footprint.corners.T, axis=1) + footprint.radius
    reached = support(body.shape, body.pose, aside)
    assert np.all(reached >= needed - 1e-9)
    assert np.all(reached <= needed + 0.1 * footprint.radius + 1e-9)


def test_clearances_by_class() -> None:
    asked = Clearances(arm_arm=0.03, self_collision=0.0)
    assert asked.required(PairClass.ARM_ARM) == 0.03
    assert asked.required(PairClass.SELF) == 0.0
    assert asked.required(PairClass.ARM_OBSTACLE) is None


def test_an_arm_without_equipment_brings_nothing() -> None:
    surroundings = Surroundings(equipment={"a": Equipment(tool=(BALL,))})
    assert surroundings.of("a").tool == (BALL,)
    assert surroundings.of("b").tool == ()


def test_surroundings_travel_to_worker_processes() -> None:
    surroundings = Surroundings((BALL, FLOOR), Part((BALL,), 0.1), equipment={"a": Equipment((BALL,))})
    again = pickle.loads(pickle.dumps(surroundings))
    assert [o.name for o in again.obstacles] == ["ball", "floor"]
    assert again.of("a").tool[0].shape == Sphere(0.1)


def test_the_footprint_is_the_arms_own_or_its_pedestals_or_the_origin() -> None:
    plate, foot = Footprint.disc(0.3), Footprint.rectangle(0.4, 0.2)
    equipment = {
        "a": Equipment(pedestal=Pedestal(0.5, foot), footprint=plate),
        "b": Equipment(pedestal=Pedestal(1.0, foot)),
    }
    around = Surroundings(equipment=equipment)
    assert around.footprint("a") is plate
    assert around.footprint("b") is foot
    assert around.footprint("c") is POINT
