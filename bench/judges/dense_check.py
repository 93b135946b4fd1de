"""A slow judge of layouts: every millimetre of the path, every pair, by Pinocchio, Coal and Shapely alone.

It shares no code with what duocell checks itself by (`duocell.optimizer.clearance.clearance`,
`duocell.models.collision.collision`), reads the rules a second time, and is used to judge answers, not to find them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf, radians

import numpy as np
import pinocchio as pin

from bench.judges.dense_bodies import DenseBodies
from bench.judges.dense_path import Lost, ObjectSteps, follow, object_steps
from bench.judges.dense_rules import coupling_excess, floor_gap, region_excess
from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.kinematics import FLANGE, characteristic_length, pinocchio_model
from duocell.models.robot.arm import Arm
from duocell.optimizer.results.layout import Layout

LENGTH, ANGLE = 1e-3, radians(0.5)
"""m and rad; steps of the object."""
EXACT = 1e-6
"""m or rad; what counts as kept."""


@dataclass(frozen=True, slots=True)
class Nearest:
    """Where a class of pairs comes nearest.

    Attributes:
        required: m. distance: m, signed. first, second: names of the bodies.
        pose: number of the pose before. fraction: of the way to the next.
    """

    required: float
    distance: float
    first: str
    second: str
    pose: int
    fraction: float


@dataclass(frozen=True, eq=False)
class Verdict:
    """What the dense check found; distances and excesses in m and rad.

    Attributes:
        nearest: class word -> closest pair; classes asked for that have pairs.
        lost: arms that cannot follow the object.
        pose_error: of the hands at the poses, m and rad. limit_excess: of joints at any sample, negative: what is left.
        step_excess: of the joint steps between poses. conditioning_violation: of σmin/σmax at the poses, 0 if none.
        region_excess: of bases. floor_gap: smallest. coupling_excess: largest.
        samples: configurations looked at.
    """

    nearest: dict[str, Nearest]
    lost: tuple[Lost, ...]
    pose_error: float
    limit_excess: float
    step_excess: float
    conditioning_violation: float
    region_excess: float
    floor_gap: float
    coupling_excess: float
    samples: int

    @property
    def faults(self) -> list[str]:
        """What is wrong, one phrase each; empty for a clean layout."""
        found = [
            f"{kind}: {n.first} and {n.second} {n.distance:.5f} m apart after pose {n.pose} + {n.fraction:.2f}, "
            f"{n.required:g} m required"
            for kind, n in self.nearest.items()
            if n.distance < n.required - EXACT
        ]
        found += [f"{o.arm} lost after pose {o.pose} + {o.fraction:.2f}, off by {o.off:.2g}" for o in self.lost]
        numbers = {
            "pose error": self.pose_error,
            "joint limits exceeded": self.limit_excess,
            "joint step exceeded": self.step_excess,
            "conditioning violation": self.conditioning_violation,
            "outside of the region": self.region_excess,
            "floor broken": -self.floor_gap,
            "coupling broken": self.coupling_excess,
        }
        return found + [f"{name} by {value:.3g}" for name, value in numbers.items() if value > EXACT]

    @property
    def clean(self) -> bool:
        """True if nothing is wrong."""
        return not self.faults


def judge(cell: Cell, layout: Layout, length: float = LENGTH, angle: float = ANGLE) -> Verdict:
    """The verdict on a complete layout of a cell.

    Args:
        cell: with six-jointed arms.
        layout: with one placement per arm.
        length: m. angle: rad, steps of the object.
    """
    by_name = {placement.arm: placement for placement in layout.placements}
    chosen = [by_name[arm.name] for arm in cell.arms]
    stands = np.array([[*placement.position, placement.yaw] for placement in chosen])
    return dense_check(cell, stands, [placement.joints for placement in chosen], length, angle)


def dense_check(
    cell: Cell, stands: Floats, joints: Sequence[Floats], length: float = LENGTH, angle: float = ANGLE
) -> Verdict:
    """The verdict on bases and joints; the segments of a task sequence are looked at one by one, nothing lies between
    them.

    Args:
        cell: with six-jointed arms.
        stands: (A, 4) x, y, z [m] and yaw [rad] of each base.
        joints: per arm (m, 6) rad at the poses.
        length: m. angle: rad, steps of the object.
    """
    verdicts = []
    for segment, some in enumerate(cell.task.segments):
        verdict = _one_segment(cell.alone(segment), stands, [q[some] for q in joints], length, angle)
        verdicts.append(_counted_from(some.start, verdict))
    first = verdicts[0]
    nearest = {kind: min((v.nearest[kind] for v in verdicts), key=lambda n: n.distance) for kind in first.nearest}
    return replace(
        first,
        nearest=nearest,
        lost=tuple(lost for verdict in verdicts for lost in verdict.lost),
        pose_error=max(v.pose_error for v in verdicts),
        limit_excess=max(v.limit_excess for v in verdicts),
        step_excess=max(v.step_excess for v in verdicts),
        conditioning_violation=max(v.conditioning_violation for v in verdicts),
        samples=sum(v.samples for v in verdicts),
    )


def _counted_from(first: int, verdict: Verdict) -> Verdict:
    """The verdict on a segment with its poses numbered as in the whole task."""
    nearest = {kind: replace(found, pose=found.pose + first) for kind, found in verdict.nearest.items()}
    return replace(verdict, nearest=nearest, lost=tuple(replace(o, pose=o.pose + first) for o in verdict.lost))


def _one_segment(cell: Cell, stands: Floats, joints: Sequence[Floats], length: float, angle: float) -> Verdict:
    """The verdict on the only segment of a cell."""
    bases = [base_in_world(arm, stand) for arm, stand in zip(cell.arms, stands, strict=True)]
    steps = object_steps(cell.task.poses, length, angle)
    followed, lost = [], []
    for arm, base, q in zip(cell.arms, bases, joints, strict=True):
        rows, astray = follow(arm, base, steps, q)
        followed.append(rows)
        lost += [astray] if astray is not None else []
    pairs = list(zip(cell.arms, bases, joints, strict=True))
    return Verdict(
        nearest=_nearest(cell, np.array(bases), followed, steps),
        lost=tuple(lost),
        pose_error=max(_pose_error(cell, arm, base, q) for arm, base, q in pairs),
        limit_excess=max(
            float(np.max(np.maximum(arm.lower - q, q - arm.upper))) for arm, q in zip(cell.arms, followed, strict=True)
        ),
        step_excess=max(float(np.max(np.abs(np.diff(q, axis=0)), initial=0.0)) for q in joints) - cell.max_joint_step,
        conditioning_violation=max(_conditioning_violation(arm, q) for arm, _, q in pairs),
        region_excess=max(region_excess(arm, stand) for arm, stand in zip(cell.arms, stands, strict=True)),
        floor_gap=min(floor_gap(cell, a, stand) for a, stand in enumerate(stands)),
        coupling_excess=max((coupling_excess(tie, stands) for tie in cell.couplings), default=0.0),
        samples=len(steps.poses),
    )


def base_in_world(arm: Arm, stand: Floats) -> Floats:
    """(4, 4) base frame from x, y, z and yaw."""
    base = np.eye(4)
    base[:3, :3] = arm.mount @ pin.exp3(np.array([0.0, 0.0, stand[3]]))
    base[:3, 3] = stand[:3]
    return base


def _nearest(cell: Cell, bases: Floats, joints: list[Floats], steps: ObjectSteps) -> dict[str, Nearest]:
    """Closest pair of every class over all samples."""
    bodies = DenseBodies(cell, bases)
    best: dict[str, Nearest] = {}
    for k, pose in enumerate(steps.poses):
        places = bodies.place([q[k] for q in joints], pose)
        found = bodies.nearest(places, {kind: nearest.distance for kind, nearest in best.items()})
        for kind, (distance, i, j) in found.items():
            word = "self_collision" if kind == "self" else kind
            required = getattr(cell.surroundings.clearances, word)
            names = bodies.solids[i].name, bodies.solids[j].name
            best[kind] = Nearest(required, distance, *names, int(steps.step[k]), float(steps.fraction[k]))
    return best


def _pose_error(cell: Cell, arm: Arm, base: Floats, joints: Floats) -> float:
    """Largest component of the twists between the hands and where they should be, over the poses."""
    model = pinocchio_model(arm.robot)
    data, frame = model.createData(), model.getFrameId(FLANGE)
    worst = 0.0
    for q, pose in zip(joints, cell.task.poses, strict=True):
        pin.framesForwardKinematics(model, data, q)
        hand = pin.SE3(base) * data.oMf[frame] * pin.SE3(arm.tool)
        worst = max(worst, float(np.max(np.abs(pin.log6(hand.actInv(pin.SE3(pose @ arm.grasp))).vector))))
    return worst


def _conditioning_violation(arm: Arm, joints: Floats) -> float:
    """By how much σmin/σmax at the poses falls short of what the arm asks for; 0 if it does not."""
    if arm.min_conditioning is None:
        return 0.0
    model = pinocchio_model(arm.robot)
    data, frame = model.createData(), model.getFrameId(FLANGE)
    least = inf
    for q in joints:
        jacobian = pin.computeFrameJacobian(model, data, q, frame, pin.ReferenceFrame.LOCAL)
        jacobian = pin.SE3(arm.tool).inverse().action @ jacobian
        jacobian[:3] /= characteristic_length(arm.robot)
        values = np.linalg.svd(jacobian, compute_uv=False)
        least = min(least, float(values[-1] / values[0]))
    return max(0.0, arm.min_conditioning - least)
