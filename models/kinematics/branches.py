"""Evaluation of the closed forms: all eight inverse-kinematics branches of many poses at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.kinematics.closed_form import ClosedForm
from duocell.models.robot.posture import Signs, signs_from

ROUNDING = 1e-12
"""Excess of a cosine over 1 that is rounding."""
Sign = int | Ints
"""+1 or -1, or an array (N, 1) of them."""


@dataclass(frozen=True, eq=False, slots=True)
class Branches:
    """Branches of a batch of paths; the first axis of branches is ordered as `duocell.models.robot.posture.ALL_SIGNS`.

    Attributes:
        joints: (6, 8, ..., m) rad, modulo 2π.
        missing: (8, ..., m) m, how much too far or too near the pose is; 0 where the branch exists. For an oblique
            wrist, what its cone lacks (a cosine) is added.
    """

    joints: Floats
    missing: Floats


def solve_branches(form: ClosedForm, rotations: Floats, positions: Floats) -> Branches:
    """All branches of flange poses given in the base frame.

    Args:
        form: constants of the robot.
        rotations: (m, 3, 3) or (..., m, 3, 3) flange orientation.
        positions: (..., m, 3) m, flange position.

    Returns:
        The branches; where ``missing`` is positive the joints are those of the nearest possible triangle.
    """
    seen = _Seen(form, rotations, positions)
    joints = np.empty((6, 2, 2, 2, *seen.shape))
    missing = np.empty((2, 2, 2, *seen.shape))
    solve = _spherical if form.kind == "spherical-wrist" else _three_parallel
    for index, shoulder in enumerate((1, -1)):
        plane = _Plane(seen, shoulder)
        solve(plane, (1, -1), (1, -1), joints[:, index], missing[index])
    return Branches(joints.reshape(6, 8, *seen.shape), missing.reshape(8, *seen.shape))


def solve_signed(form: ClosedForm, rotations: Floats, positions: Floats, signs: Ints) -> Branches:
    """One chosen branch per path: as `solve_branches`, with ``signs`` (N, 3) for ``positions`` (N, m, 3).

    Returns:
        Branches with a first axis of length 1: joints (6, 1, N, m), missing (1, N, m).
    """
    seen = _Seen(form, rotations, positions)
    joints, missing = np.empty((6, 1, 1, *seen.shape)), np.empty((1, 1, *seen.shape))
    shoulder, elbow, wrist = (signs[:, k, None] for k in range(3))
    solve = _spherical if form.kind == "spherical-wrist" else _three_parallel
    solve(_Plane(seen, shoulder), (elbow,), (wrist,), joints, missing)
    return Branches(joints[:, 0], missing[0])


class _Seen:
    """The poses as the arm sees them: W from axis 1, and the turn that the six joints have to make."""

    def __init__(self, form: ClosedForm, rotations: Floats, positions: Floats) -> None:
        self.form = form
        self.wrist = positions + rotations @ form.wrist_in_flange - form.origin
        self.turned = rotations @ form.home_rotation.T
        self.shape = np.broadcast_shapes(self.wrist.shape[:-1], self.turned.shape[:-2])


class _Plane:
    """Joint 1 for one sign of the shoulder, and W in the plane of the arm.

    Attributes:
        first: (..., m) rad, q1. front, height: (..., m) m, coordinates of W in the plane, from the origin on axis 1.
        missing: (..., m) m.
    """

    def __init__(self, seen: _Seen, shoulder: Sign) -> None:
        form, wrist = seen.form, seen.wrist
        h1 = form.axes[0]
        lean = float(form.n @ h1)
        across = form.n - lean * h1
        length = float(np.linalg.norm(across))
        along = wrist @ h1
        side, front = wrist @ (across / length), wrist @ form.forward
        distance = np.hypot(side, front)
        offset = (form.offset - lean * along) / length
        half = np.arccos(np.clip(offset / np.maximum(distance, 1e-300), -1.0, 1.0))
        self.seen, self.shoulder = seen, shoulder
        self.missing = np.maximum(np.abs(offset) - distance, 0.0)
        self.first = np.arctan2(-front, side) + shoulder * half
        self.front = shoulder * np.sqrt(np.maximum(distance**2 - offset**2, 0.0))
        self.height = along * float(form.up @ h1) + offset * float(form.up @ across) / length


def _triangle(form: ClosedForm, front: Floats, height: Floats, bend: Sign) -> tuple[Floats, Floats, Floats]:
    """(turn 2, turn 3, missing): the two links from the shoulder to (front, height), elbow turned by sign ``bend``."""
    plane = form.planar
    x, y = front - plane.shoulder[0], height - plane.shoulder[1]
    square = x * x + y * y
    cosine = (square - plane.upper**2 - plane.fore**2) / (2.0 * plane.upper * plane.fore)
    elbow = bend * np.arccos(np.clip(cosine, -1.0, 1.0))
    distance = np.sqrt(square)
    missing = np.maximum(distance - (plane.upper + plane.fore), abs(plane.upper - plane.fore) - distance)
    inner = np.arctan2(plane.fore * np.sin(elbow), plane.upper + plane.fore * np.cos(elbow))
    return np.arctan2(x, y) - inner - plane.upper_angle, elbow - plane.elbow_angle, np.maximum(missing, 0.0)


def _spherical(
    plane: _Plane, elbows: tuple[Sign, ...], wrists: tuple[Sign, ...], joints: Floats, missing: Floats
) -> None:
    """Fill joints (6, elbow, wrist, ..., m) and missing (elbow, wrist, ..., m) for one shoulder, spherical wrist."""
    form, turned, first = plane.seen.form, plane.seen.turned, plane.first
    h1, h4, h5, h6 = form.axes[0], form.axes[3], form.axes[4], form.axes[5]
    turn = _Turn(h1, first)
    tool_axis = turn.back(_components(turned @ h6))
    for e, elbow in enumerate(elbows):
        second, third, short = _triangle(form, plane.front, plane.height, -plane.shoulder * elbow)
        pitch = _Turn(form.n, second + third)
        seen = pitch.back(tool_axis)
        fore_seen = _transposed(turned, turn.on(pitch.on(h4)))
        bend, cone = _bend(form, _dot(h4, seen))
        for f, wrist in enumerate(wrists):
            fifth = form.wrist_zero + wrist * bend
            bent = _Turn(h5, fifth)
            fourth = _angle(h4, bent.on(h6), seen)
            sixth = -_angle(h6, bent.back(h4), fore_seen)
            joints[:, e, f] = first, form.turns[1] * second, form.turns[2] * third, fourth, fifth, sixth
            missing[e, f] = plane.missing + short + cone


def _three_parallel(
    plane: _Plane, elbows: tuple[Sign, ...], wrists: tuple[Sign, ...], joints: Floats, missing: Floats
) -> None:
    """Fill joints (6, elbow, wrist, ..., m) and missing (elbow, wrist, ..., m) for one shoulder of parallel axes."""
    form, turned, first = plane.seen.form, plane.seen.turned, plane.first
    h1, h5, h6, n, turns = form.axes[0], form.axes[4], form.axes[5], form.n, form.turns
    turn = _Turn(h1, first)
    n_seen = _transposed(turned, turn.on(n))
    bend, cone = _bend(form, _dot(h6, n_seen))
    hand = form.planar.hand
    for f, wrist in enumerate(wrists):
        fifth = form.wrist_zero + wrist * bend
        sixth = -_angle(h6, _Turn(h5, fifth).back(n), n_seen)
        fifth_axis = turn.back(_applied(turned, _Turn(h6, sixth).back(h5)))
        pitch = _angle(n, h5, fifth_axis)
        cos, sin = np.cos(pitch), np.sin(pitch)
        front = plane.front - (hand[0] * cos + hand[1] * sin)
        height = plane.height - (hand[1] * cos - hand[0] * sin)
        for e, elbow in enumerate(elbows):
            second, third, short = _triangle(form, front, height, -plane.shoulder * elbow)
            fourth = turns[3] * (pitch - second - third)
            joints[:, e, f] = first, turns[1] * second, turns[2] * third, fourth, fifth, sixth
            missing[e, f] = plane.missing + short + cone


def _bend(form: ClosedForm, cosine: Floats) -> tuple[Floats, Floats]:
    """|q5 - wrist_zero| in [0, π], and how far an oblique wrist is from being able to turn there (cosine, 0 if it is).

    The cosine is the one between the two axes that joint 5 turns against each other. Axes at right angles, the common
    case, can take any angle; an oblique wrist only those inside a cone.
    """
    ratio = (cosine - form.tilt_cos) / form.tilt_sin
    value = np.arccos(np.clip(ratio, -1.0, 1.0))
    return np.pi - value if form.flipped_zero else value, np.maximum(np.abs(ratio) - 1.0 - ROUNDING, 0.0)


Components = Sequence[Any] | Floats
"""x, y and z of vectors, each an array or a number: arrays with three numbers in their last axis are slow."""


class _Turn:
    """The turn about a fixed unit ``axis`` (3,) by ``angle`` (...), after Rodrigues."""

    def __init__(self, axis: Floats, angle: Floats) -> None:
        self.axis, self.cos, self.sin = axis, np.cos(angle), np.sin(angle)

    def on(self, vector: Components) -> Components:
        """The vector, turned."""
        return self._turned(vector, self.sin)

    def back(self, vector: Components) -> Components:
        """The vector, turned the other way."""
        return self._turned(vector, -self.sin)

    def _turned(self, vector: Components, sin: Floats) -> Components:
        axis, cos = self.axis, self.cos
        along = _dot(axis, vector)
        turned = []
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            value = cos * vector[i]
            if axis[i]:  # many axes are coordinate axes
                value += (1.0 - cos) * (axis[i] * along)
            if axis[j]:
                value += sin * (axis[j] * vector[k])
            if axis[k]:
                value -= sin * (axis[k] * vector[j])
            turned.append(value)
        return turned


def _angle(axis: Floats, start: Components, end: Components) -> Floats:
    """Angle (...) about ``axis`` that takes direction ``start`` to ``end``."""
    sine, cosine = 0.0, -_dot(axis, start) * _dot(axis, end)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        cosine = cosine + start[i] * end[i]
        if axis[i]:
            sine = sine + axis[i] * (start[j] * end[k] - start[k] * end[j])
    return np.asarray(np.arctan2(sine, cosine))


def _dot(axis: Floats, vector: Components) -> Any:
    """Component along ``axis`` (3,)."""
    return sum(axis[i] * vector[i] for i in range(3) if axis[i])


def _components(vectors: Floats) -> Components:
    """Of vectors (..., 3)."""
    return [vectors[..., 0], vectors[..., 1], vectors[..., 2]]


def _applied(matrices: Floats, vector: Components) -> Components:
    """``matrices @ vector`` for matrices (..., 3, 3)."""
    return [sum(matrices[..., i, j] * vector[j] for j in range(3)) for i in range(3)]


def _transposed(matrices: Floats, vector: Components) -> Components:
    """``matricesᵀ @ vector`` for matrices (..., 3, 3)."""
    return [sum(matrices[..., j, i] * vector[j] for j in range(3)) for i in range(3)]


def posture_terms(
    form: ClosedForm, q: Any, sin: Callable[[Any], Any], cos: Callable[[Any], Any]
) -> tuple[Any, Any, Any]:
    """The three smooth quantities whose signs are the posture, for numbers and for CasADi symbols alike.

    Args:
        form: constants of the robot.
        q: six joint values [rad]: a (6, ...) array or a sequence of symbols.
        sin: sine of the number type. cos: its cosine.

    Returns:
        front: coordinate of W in front of axis 1 [m]; its sign is the shoulder's.
        elbow: sine of the turn from upper arm to forearm; the elbow's sign is ``-sign(front · elbow)``.
        wrist: sine of joint 5 beyond its singular value; its sign is the wrist's.
    """
    plane = form.planar
    upper = plane.upper_angle + form.turns[1] * q[1]
    bend = plane.elbow_angle + form.turns[2] * q[2]
    front = plane.shoulder[0] + plane.upper * sin(upper) + plane.fore * sin(upper + bend)
    if form.kind == "three-parallel":
        pitch = form.turns[1] * q[1] + form.turns[2] * q[2] + form.turns[3] * q[3]
        front = front + plane.hand[0] * cos(pitch) + plane.hand[1] * sin(pitch)
    return front, sin(bend), sin(q[4] - form.wrist_zero)


def signs_of(form: ClosedForm, joints: Floats) -> Ints:
    """Signs (..., 3) of shoulder, elbow and wrist (0 on a singular set) of joint values (..., 6) [rad]."""
    front, elbow, wrist = posture_terms(form, np.moveaxis(joints, -1, 0), np.sin, np.cos)
    signs: Ints = np.stack([np.sign(front), -np.sign(front * elbow), np.sign(wrist)], axis=-1).astype(np.int64)
    return signs


def posture_of(form: ClosedForm, q: Floats) -> Signs:
    """Signs of shoulder, elbow and wrist of joint values (6,) [rad]; on a singular set the positive side."""
    return signs_from(signs_of(form, q))


def path_signs(form: ClosedForm, joints: Floats) -> Signs:
    """The posture (shoulder, elbow, wrist) of a path (m, 6) [rad]: the sign each quantity has where it is not zero."""
    return signs_from(np.sum(signs_of(form, joints), axis=0))
