"""A robot: the kinematic chain of one arm from its base frame to its flange, with limits and provenance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from duocell.models.base.arrays import Floats, set_frozen
from duocell.models.base.errors import InvalidInput
from duocell.models.robot.linear_limits import LinearLimits
from duocell.models.robot.robot_frames import RobotFrame


@dataclass(frozen=True, eq=False)
class Robot:
    """A serial arm of revolute joints, without tool, grasp or place.

    The transform of the flange in the base frame is
    ``Π_i (joint_placements[i] · Rot(joint_axes[i], q_i)) · flange_placement``.

    Attributes:
        name: catalogue name, or a label of an inline or URDF robot.
        joint_names: n names.
        joint_placements: (n, 4, 4) joint frame in the frame of the joint before (first: the base frame) at q = 0.
        joint_axes: (n, 3) unit axis in the joint's own frame.
        flange_placement: (4, 4) flange in the last joint frame.
        lower: (n,) rad, ``-inf`` where the joint turns without end.
        upper: (n,) rad, ``inf`` where the joint turns without end.
        reference: (n,) rad, the q* used when a request names none.
        reference_source: "mid-range", or why another reference was chosen.
        base_frame: name of the first frame. flange_frame: name of the last.
        maker: manufacturer. title: human-readable model. source: where geometry and limits come from.
        licence: licence of that source.
        notes: remarks worth showing to a user (mounting face, open limits, ...).
        ssik_name: name of the arm's artifact in ssik, or None for robots from elsewhere.
        flanges: frames that a tool can be attached to, the usual one first; empty: the last frame is the only one.
        mounting_face: what the base is bolted down with, in the base frame; None where it is not known.
        linear_limits: limits between the joints; None where none are known.
        description: digest of the file that describes it, "" for robots of no file: arms of one machine have it in
            common.
    """

    name: str
    joint_names: tuple[str, ...]
    joint_placements: Floats
    joint_axes: Floats
    flange_placement: Floats
    lower: Floats
    upper: Floats
    reference: Floats
    reference_source: str = "mid-range"
    base_frame: str = "base"
    flange_frame: str = "flange"
    maker: str = ""
    title: str = ""
    source: str = ""
    licence: str = ""
    notes: tuple[str, ...] = ()
    ssik_name: str | None = None
    flanges: tuple[RobotFrame, ...] = ()
    mounting_face: RobotFrame | None = None
    description: str = ""
    linear_limits: LinearLimits | None = None

    def __post_init__(self) -> None:
        n = len(self.joint_names)
        set_frozen(self, "joint_placements", self.joint_placements, (n, 4, 4))
        set_frozen(self, "joint_axes", self.joint_axes, (n, 3))
        set_frozen(self, "flange_placement", self.flange_placement, (4, 4))
        for name in ("lower", "upper", "reference"):
            set_frozen(self, name, getattr(self, name), (n,))

    @property
    def dof(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    @cached_property
    def kinematic_key(self) -> tuple[bytes, bytes, bytes]:
        """Equal for robots with the same geometry, whatever their names and limits: the key of compiled kinematics."""
        return (self.joint_placements.tobytes(), self.joint_axes.tobytes(), self.flange_placement.tobytes())

    @property
    def flange_names(self) -> tuple[str, ...]:
        """What a tool can be attached to, the usual frame first."""
        return tuple(frame.name for frame in self.flanges) or (self.flange_frame,)

    def flange(self, name: str | None = None) -> Floats:
        """(4, 4) m, a flange in the last frame of the chain; the usual one if no name is given.

        Raises:
            InvalidInput: the robot has no such flange; the detail lists those it has.
        """
        if name is not None and name not in self.flange_names:
            raise InvalidInput(
                f"{self.name} has no flange {name[:80]!r}; it has {' and '.join(self.flange_names)}. "
                "Leave it out to take the first."
            )
        chosen = [frame.pose for frame in self.flanges if name in (None, frame.name)]
        return chosen[0] if chosen else np.eye(4)

    @property
    def limited(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """(n,) True for joints with two finite limits."""
        return np.isfinite(self.lower) & np.isfinite(self.upper)

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, dof={self.dof})"
