"""The cell of `examples/beam_cell.json`: two UR10e carry a beam of 1.2 m from a conveyor to a fixture table."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_x, rotation_y, transform
from duocell.models.catalogue.catalogue import robot
from duocell.models.cell.cell import Cell
from duocell.models.cell.floor import Floor, Footprint
from duocell.models.cell.surroundings import Clearances, Equipment, Part, Pedestal, Surroundings
from duocell.models.cell.task import Task
from duocell.models.geometry.shapes import Body, Box, Capsule, Cylinder, HalfSpace
from duocell.models.robot.arm import FREE_YAW, Arm, BaseRegion, Interval, range_weights

BEAM = np.array([1.2, 0.08, 0.08])
"""m; a steel section carried by its ends."""
CLEARANCE = 0.03
PEDESTAL = 0.6
"""m, height of both pedestals: the base origins stand there."""
CONVEYOR_TOP, TABLE_TOP = 0.75, 0.80
"""m above the floor."""


def beam_cell(clearance: float | None = CLEARANCE) -> Cell:
    """The cell: the beam lies along x on a conveyor (-y), is lifted, carried to +y and set into a fixture.

    Args:
        clearance: m, kept by every class but self-collision (which may come to contact); None for a cell whose arms
            know nothing of what stands around them.
    """
    arms = tuple(_arm(name, side) for name, side in (("main", -1.0), ("follower", 1.0)))
    gripper = Body("gripper", transform(np.eye(3), [0.0, 0.0, 0.08]), Cylinder(0.05, 0.16))
    pedestal = Pedestal(PEDESTAL, Footprint.rectangle(0.3, 0.3))
    asked = Clearances() if clearance is None else Clearances(*(clearance,) * 4, self_collision=0.0)
    around = Surroundings(
        obstacles=_obstacles(),
        part=Part((Body("beam", np.eye(4), Box(BEAM)),), grasp_zone=0.16),
        floor=_floor(),
        clearances=asked,
        equipment={arm.name: Equipment((gripper,), pedestal) for arm in arms},
    )
    return Cell(Task(_poses()), arms, name="beam from conveyor to fixture", surroundings=around)


def _poses() -> Floats:
    """Thirteen poses: up from the conveyor, across, down onto the fixture."""
    lying = CONVEYOR_TOP + 0.05 + 0.5 * BEAM[2]
    fixed = TABLE_TOP + 0.10 + 0.5 * BEAM[2]
    heights = [lying, lying + 0.12, lying + 0.24, *[lying + 0.27] * 6, fixed + 0.18, fixed + 0.10, fixed + 0.05, fixed]
    across = [-0.45, -0.45, -0.45, -0.35, -0.2, -0.05, 0.1, 0.25, 0.4, 0.45, 0.45, 0.45, 0.45]
    return transform(np.eye(3), np.column_stack([np.zeros(len(across)), across, heights]))


def _arm(name: str, side: float) -> Arm:
    """The main arm on the -x side, the follower on the +x side; both hold the beam from above."""
    chosen = robot("ur10e")
    grasp = transform(rotation_x(np.pi), [side * 0.5, 0.0, 0.5 * BEAM[2]])
    x = Interval(-1.7, -0.8) if side < 0.0 else Interval(0.8, 1.7)
    height = Interval(PEDESTAL, PEDESTAL)
    return Arm(
        name=name,
        robot=chosen,
        tool=transform(np.eye(3), [0.0, 0.0, 0.16]),
        grasp=grasp,
        base=BaseRegion(x, Interval(-1.0, 1.0), height, FREE_YAW),
        lower=chosen.lower,
        upper=chosen.upper,
        reference=chosen.reference,
        weights=range_weights(chosen.lower, chosen.upper),
    )


def _block(name: str, low: tuple[float, float, float], high: tuple[float, float, float]) -> Body:
    """A box between two corners."""
    a, b = np.array(low), np.array(high)
    return Body(name, transform(np.eye(3), 0.5 * (a + b)), Box(b - a))


def _obstacles() -> tuple[Body, ...]:
    """The floor, a conveyor that comes in from -y, the fixture table with two posts, a cabinet, a camera portal."""
    return (
        Body("floor", np.eye(4), HalfSpace()),
        _block("conveyor", (-0.35, -1.9, 0.0), (0.35, -0.25, CONVEYOR_TOP)),
        _block("fixture table", (-0.45, 0.2, 0.0), (0.45, 0.9, TABLE_TOP)),
        _block("fixture left", (-0.3, 0.40, TABLE_TOP), (-0.2, 0.50, TABLE_TOP + 0.06)),
        _block("fixture right", (0.2, 0.40, TABLE_TOP), (0.3, 0.50, TABLE_TOP + 0.06)),
        _block("control cabinet", (-1.9, 0.7, 0.0), (-1.3, 1.5, 1.8)),
        Body("portal post left", transform(np.eye(3), [-0.95, 0.05, 1.1]), Cylinder(0.04, 2.2)),
        Body("portal post right", transform(np.eye(3), [0.95, 0.05, 1.1]), Cylinder(0.04, 2.2)),
        Body("portal crossbar", transform(rotation_y(np.pi / 2), [0.0, 0.05, 2.2]), Capsule(0.05, 1.9)),
    )


def _floor() -> Floor:
    """A cell of 3.6 m by 2.8 m; an aisle and what stands on the floor are not free."""
    allowed = np.array([[-1.8, -1.4], [1.8, -1.4], [1.8, 1.4], [-1.8, 1.4]])
    conveyor = np.array([[-0.45, -1.9], [0.45, -1.9], [0.45, -0.2], [-0.45, -0.2]])
    table = np.array([[-0.55, 0.15], [0.55, 0.15], [0.55, 1.0], [-0.55, 1.0]])
    return Floor(allowed, (conveyor, table), margin=0.05)
