"""A robot: the kinematic chain of one arm from its base frame to its flange, with limits and provenance."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from duocell.models.base.arrays import Bools, Floats, set_frozen
from duocell.models.base.errors import InvalidInput
from duocell.models.robot.joint import JointKind, JointMotions
from duocell.models.robot.linear_limits import LinearLimits
from duocell.models.robot.robot_frames import RobotFrame

KinematicKey = tuple[bytes, bytes, bytes, bytes]
"""Placements, axes and kinds of the joints, and the flange, as bytes."""


@dataclass(frozen=True, eq=False)
class Robot:
    """A serial arm without tool, grasp or place. Its joints turn; the first may be a linear axis that carries the rest.

    The transform of the flange in the base frame is ``Π_i (joint_placements[i] · T_i(q_i)) · flange_placement``, with
    T_i of `duocell.models.robot.joint`. Values of revolute joints are rad, those of prismatic ones m.

    Attributes:
        name: catalogue name, or a label of an inline or URDF robot.
        joint_names: n names.
        joint_placements: (n, 4, 4) joint frame in the frame of the joint before (first: the base frame) at q = 0.
        joint_axes: (n, 3) unit axis in the joint's own frame.
        flange_placement: (4, 4) flange in the last joint frame.
        lower: (n,) rad or m, ``-inf`` where the joint turns without end.
        upper: (n,) rad or m, ``inf`` where the joint turns without end.
        reference: (n,) rad or m, the q* used when a request names none.
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
        joint_kinds: n kinds; empty: all joints are revolute.
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
    joint_kinds: tuple[JointKind, ...] = ()

    def __post_init__(self) -> None:
        n = len(self.joint_names)
        object.__setattr__(self, "joint_kinds", self.joint_kinds or n * (JointKind.REVOLUTE,))
        if len(self.joint_kinds) != n:
            raise ValueError(f"{len(self.joint_kinds)} kinds for {n} joints")
        if JointKind.PRISMATIC in self.joint_kinds[1:]:
            raise ValueError("only the first joint may be prismatic")
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
    def kinematic_key(self) -> KinematicKey:
        """Equal for robots with the same geometry, whatever their names and limits: the key of compiled kinematics."""
        arrays = self.joint_placements, self.joint_axes, self.prismatic, self.flange_placement
        placements, axes, prismatic, flange = (array.tobytes() for array in arrays)
        return placements, axes, prismatic, flange

    @cached_property
    def prismatic(self) -> Bools:
        """(n,) True for joints that shift."""
        prismatic: Bools = np.array([kind is JointKind.PRISMATIC for kind in self.joint_kinds], dtype=np.bool_)
        return prismatic

    @cached_property
    def slides(self) -> bool:
        """True if some joint shifts."""
        return bool(np.any(self.prismatic))

    @cached_property
    def carried(self) -> Robot | None:
        """The arm that a linear axis carries, by itself, its base frame where the carriage is; None without one."""
        if not self.slides:
            return None
        return replace(
            self,
            joint_names=self.joint_names[1:],
            joint_placements=self.joint_placements[1:],
            joint_axes=self.joint_axes[1:],
            lower=self.lower[1:],
            upper=self.upper[1:],
            reference=self.reference[1:],
            joint_kinds=self.joint_kinds[1:],
            base_frame=self.joint_names[0],
            mounting_face=None,
            ssik_name=None,
            linear_limits=None,
        )

    @cached_property
    def motions(self) -> JointMotions:
        """What the joints do."""
        return JointMotions(self.prismatic, self.joint_axes)

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
