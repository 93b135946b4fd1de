"""Poses as 4x4 homogeneous transforms, and rotations in every format a request may use.

``T_a^b`` is frame b seen from a; a stack of poses has shape (..., 4, 4). Angles are radians, lengths metres.
The formats accepted from users are checked here and nowhere else; see "Poses and frames" of the REST contract.
"""

from __future__ import annotations

from math import hypot, pi

import numpy as np
from numpy.typing import ArrayLike

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidRotation

TOLERANCE = 1e-3
"""How far a user's quaternion length or the stretches of a user's matrix may be from one: three printed digits."""

HALF_TURN_TOLERANCE = 1e-6
"""rad; rotations closer than this to 180° apart have no shortest way between them that could be told apart."""

_SIGN_TOLERANCE = 1e-12


def transform(rotation: ArrayLike, position: ArrayLike) -> Floats:
    """Homogeneous transforms.

    Args:
        rotation: (..., 3, 3).
        position: (..., 3) m; its leading dimensions broadcast against those of ``rotation``.

    Returns:
        (..., 4, 4).
    """
    r = np.asarray(rotation, dtype=np.float64)
    p = np.asarray(position, dtype=np.float64)
    result: Floats = np.zeros((*np.broadcast_shapes(r.shape[:-2], p.shape[:-1]), 4, 4))
    result[..., :3, :3] = r
    result[..., :3, 3] = p
    result[..., 3, 3] = 1.0
    return result


def inverse(pose: Floats) -> Floats:
    """Inverse transforms, ``(Rᵀ, -Rᵀ p)``; (3.25) of the source has a misprinted last column.

    Args:
        pose: (..., 4, 4).
    """
    back = np.swapaxes(pose[..., :3, :3], -1, -2)
    return transform(back, -(back @ pose[..., :3, 3, None])[..., 0])


# --- elementary rotations ---------------------------------------------------------------------------------------------


def rotation_about(axis: ArrayLike, angle: ArrayLike) -> Floats:
    """Rotations about one axis (Rodrigues).

    Args:
        axis: (3,) not zero; its length does not matter.
        angle: (...) rad.

    Returns:
        (..., 3, 3).
    """
    x, y, z = np.asarray(axis, dtype=np.float64) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    theta = np.asarray(angle, dtype=np.float64)[..., None, None]
    # 1 - cos as 2 sin² of the half angle: exact to the last bits for small angles too.
    result: Floats = np.eye(3) + np.sin(theta) * cross + 2.0 * np.sin(0.5 * theta) ** 2 * (cross @ cross)
    return result


def rotation_x(angle: ArrayLike) -> Floats:
    """(..., 3, 3) rotations about x by ``angle`` (...) rad."""
    return rotation_about((1.0, 0.0, 0.0), angle)


def rotation_y(angle: ArrayLike) -> Floats:
    """(..., 3, 3) rotations about y by ``angle`` (...) rad."""
    return rotation_about((0.0, 1.0, 0.0), angle)


def rotation_z(angle: ArrayLike) -> Floats:
    """(..., 3, 3) rotations about z by ``angle`` (...) rad."""
    return rotation_about((0.0, 0.0, 1.0), angle)


# --- the formats of a request -----------------------------------------------------------------------------------------


def _numbers(values: ArrayLike, shape: tuple[int, ...], what: str) -> Floats:
    """``values`` as finite floats of the given shape, or a stack of them (..., *shape), or InvalidRotation."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidRotation(f"{what} must consist of numbers in the shape {shape}.") from error
    if array.shape[-len(shape) :] != shape:
        raise InvalidRotation(f"{what} has the shape {array.shape}; {shape} is needed.")
    if not np.all(np.isfinite(array)):
        raise InvalidRotation(f"{what} holds a number that is not finite; send finite numbers only.")
    return array


def rotation_from_quaternion(quaternion: ArrayLike) -> Floats:
    """Rotations (..., 3, 3) of quaternions ``[x, y, z, w]`` (..., 4).

    Raises:
        InvalidRotation: the length of one is not within 1e-3 of one; the detail speaks of the first.
    """
    return _from_quaternion(_numbers(quaternion, (4,), "quaternion [x, y, z, w]"), "xyzw")


def _from_quaternion(q: Floats, order: str) -> Floats:
    """Rotations (..., 3, 3) of quaternions [x, y, z, w] (..., 4); ``order`` is that in which they were given."""
    lengths = np.array([hypot(*row) for row in q.reshape(-1, 4).tolist()])
    wrong = np.abs(lengths - 1.0) > TOLERANCE
    if wrong.any():
        length = lengths[np.argmax(wrong)]
        unturned = "[0, 0, 0, 1]" if order == "xyzw" else "[1, 0, 0, 0]"
        advice = f"No rotation at all is {unturned}." if length < TOLERANCE else "Normalise it."
        raise InvalidRotation(
            f"quaternion [{', '.join(order)}] has length {length:.6g}; it must be 1 to within {TOLERANCE:g}. {advice}"
        )
    x, y, z, w = np.moveaxis(q / lengths.reshape(*q.shape[:-1], 1), -1, 0)
    rows = (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def rotation_from_matrix(rows: ArrayLike) -> Floats:
    """The rotations (..., 3, 3) nearest to 3x3 matrices that are some except for their printed digits.

    Args:
        rows: (..., 3, 3). Orthonormal to 1e-3 means that no unit vector is stretched or shrunk by more than that.

    Raises:
        InvalidRotation: one is not orthonormal to 1e-3, or left-handed (the detail says which, of the first).
    """
    matrix = _numbers(rows, (3, 3), "rotation matrix")
    u, stretch, vt = np.linalg.svd(matrix)
    away = np.argmax(np.abs(stretch - 1.0), axis=-1)
    worst = np.take_along_axis(stretch, away[..., None], axis=-1).ravel()
    wrong = np.abs(worst - 1.0) > TOLERANCE
    if wrong.any():
        raise InvalidRotation(
            f"rotation matrix is not orthonormal: it stretches a unit vector to {worst[np.argmax(wrong)]:.6g}; at most "
            f"{TOLERANCE:g} away from 1 is accepted. Its columns must be unit vectors at right angles, sent row by row."
        )
    nearest: Floats = u @ vt
    if np.any(np.linalg.det(nearest) < 0.0):
        raise InvalidRotation(
            "rotation matrix is left-handed (determinant -1), a mirror image and no rotation; "
            "the third column must be the first × the second. Usually one sign is wrong."
        )
    return nearest


def rotation_from_rpy(rpy: ArrayLike) -> Floats:
    """``Rz(yaw) Ry(pitch) Rx(roll)``, (..., 3, 3), of ``[roll, pitch, yaw]`` (..., 3) rad.

    Raises:
        InvalidRotation: not three finite numbers.
    """
    roll, pitch, yaw = np.moveaxis(_numbers(rpy, (3,), "rpy [roll, pitch, yaw]"), -1, 0)
    return rotation_z(yaw) @ rotation_y(pitch) @ rotation_x(roll)


def rotation_from_euler_zyz(angles: ArrayLike) -> Floats:
    """``Rz(α) Ry(β) Rz(γ)``, (..., 3, 3), of ``[α, β, γ]`` (..., 3) rad, also what Kawasaki controllers call OAT.

    Raises:
        InvalidRotation: not three finite numbers.
    """
    alpha, beta, gamma = np.moveaxis(_numbers(angles, (3,), "euler_zyz [α, β, γ]"), -1, 0)
    return rotation_z(alpha) @ rotation_y(beta) @ rotation_z(gamma)


def rotation_from_oat(angles: ArrayLike) -> Floats:
    """``Rz(O - 90°) Ry(90° - A) Rz(T)``, (..., 3, 3), of ``[O, A, T]`` (..., 3) rad, (3.34) of the source.

    VAL controllers of PUMA arms print A with the opposite sign.

    Raises:
        InvalidRotation: not three finite numbers.
    """
    o, a, t = np.moveaxis(_numbers(angles, (3,), "oat [O, A, T]"), -1, 0)
    return rotation_z(o - pi / 2) @ rotation_y(pi / 2 - a) @ rotation_z(t)


def rotation_from_quaternion_wxyz(quaternion: ArrayLike) -> Floats:
    """Rotations (..., 3, 3) of quaternions ``[w, x, y, z]`` (..., 4), the order of ABB controllers (q1 to q4).

    Raises:
        InvalidRotation: the length of one is not within 1e-3 of one; the detail speaks of the first.
    """
    return _from_quaternion(_numbers(quaternion, (4,), "quaternion [w, x, y, z]")[..., [1, 2, 3, 0]], "wxyz")


def rotation_from_axis_angle(vector: ArrayLike) -> Floats:
    """Rotations (..., 3, 3) of rotation vectors (..., 3) rad: axis times angle, rx, ry, rz of Universal Robots.

    Raises:
        InvalidRotation: not three finite numbers.
    """
    v = _numbers(vector, (3,), "axis_angle [rx, ry, rz]")
    angle = np.linalg.norm(v, axis=-1)
    half = 0.5 * angle
    # sin(angle / 2) / angle, which tends to 1 / 2.
    scale = 0.5 * np.sinc(half / pi)
    return _from_quaternion(np.concatenate([v * scale[..., None], np.cos(half)[..., None]], axis=-1), "xyzw")


def rotation_from_abc_deg(angles: ArrayLike) -> Floats:
    """``Rz(A) Ry(B) Rx(C)``, (..., 3, 3), of ``[A, B, C]`` (..., 3) degrees, as KUKA controllers write them.

    Raises:
        InvalidRotation: not three finite numbers.
    """
    a, b, c = np.moveaxis(np.radians(_numbers(angles, (3,), "abc_deg [A, B, C]")), -1, 0)
    return rotation_z(a) @ rotation_y(b) @ rotation_x(c)


def rotation_from_wpr_deg(angles: ArrayLike) -> Floats:
    """``Rz(R) Ry(P) Rx(W)``, (..., 3, 3), of ``[W, P, R]`` (..., 3) degrees, as FANUC controllers write them.

    Raises:
        InvalidRotation: not three finite numbers.
    """
    w, p, r = np.moveaxis(np.radians(_numbers(angles, (3,), "wpr_deg [W, P, R]")), -1, 0)
    return rotation_z(r) @ rotation_y(p) @ rotation_x(w)


# --- measures and ways back -------------------------------------------------------------------------------------------


def _versor(rotation: Floats) -> Floats:
    """(..., 4) quaternions [x, y, z, w] of either sign (Shepperd: divide by the largest component)."""
    r = np.asarray(rotation, dtype=np.float64)
    xx, yy, zz = r[..., 0, 0], r[..., 1, 1], r[..., 2, 2]
    xy, xz, yz = r[..., 0, 1] + r[..., 1, 0], r[..., 0, 2] + r[..., 2, 0], r[..., 1, 2] + r[..., 2, 1]
    wx, wy, wz = r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]
    one = np.ones_like(xx)
    rows = (  # row i is 4 q_i (x, y, z, w)
        (one + xx - yy - zz, xy, xz, wx),
        (xy, one - xx + yy - zz, yz, wy),
        (xz, yz, one - xx - yy + zz, wz),
        (wx, wy, wz, one + xx + yy + zz),
    )
    outer = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    largest = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)
    row = np.take_along_axis(outer, largest[..., None, None], axis=-2)[..., 0, :]
    result: Floats = row / np.linalg.norm(row, axis=-1, keepdims=True)
    return result


def quaternion_from_rotation(rotation: Floats) -> Floats:
    """Quaternions ``[x, y, z, w]`` of rotations, of the two opposite ones always the same.

    The sign makes w positive; where w vanishes, the first component that does not.

    Args:
        rotation: (..., 3, 3).

    Returns:
        (..., 4).
    """
    q = _versor(rotation)
    order = q[..., [3, 0, 1, 2]]
    leading = np.argmax(np.abs(order) > _SIGN_TOLERANCE, axis=-1)
    sign = np.sign(np.take_along_axis(order, leading[..., None], axis=-1))
    result: Floats = q * sign
    return result


def rotation_angle(rotation: Floats) -> Floats:
    """Geodesic angles of rotations, in [0, π], accurate at both ends (unlike the arc cosine of the trace).

    Args:
        rotation: (..., 3, 3).

    Returns:
        (...) rad.
    """
    q = _versor(rotation)
    result: Floats = 2.0 * np.arctan2(np.linalg.norm(q[..., :3], axis=-1), np.abs(q[..., 3]))
    return result


def rotation_vector(rotation: Floats) -> Floats:
    """Rotation vectors (axis times angle in [0, π]) of rotations.

    Args:
        rotation: (..., 3, 3).

    Returns:
        (..., 3) rad.
    """
    q = quaternion_from_rotation(rotation)
    sine = np.linalg.norm(q[..., :3], axis=-1)
    # angle / sin(angle / 2) tends to 2 / w for vanishing angles.
    small = sine < 1e-150
    scale = np.where(small, 2.0, 2.0 * np.arctan2(sine, q[..., 3]) / np.where(small, 1.0, sine))
    result: Floats = q[..., :3] * scale[..., None]
    return result


def interpolate_rotations(start: Floats, end: Floats, fractions: ArrayLike) -> Floats:
    """Rotations on the shortest way from ``start`` to ``end``, at constant angular speed.

    Args:
        start: (3, 3).
        end: (3, 3).
        fractions: (k,) 0 at start, 1 at end.

    Returns:
        (k, 3, 3).

    Raises:
        InvalidRotation: the two are 180° apart, so that there are two shortest ways.
    """
    way = rotation_vector(start.T @ end)
    angle = float(np.linalg.norm(way))
    if angle > pi - HALF_TURN_TOLERANCE:
        raise InvalidRotation(
            "the two orientations are 180° apart, so there is no shortest rotation between them; "
            "allowed is anything less. Split the motion or send the poses one by one."
        )
    steps = np.asarray(fractions, dtype=np.float64)
    if angle == 0.0:
        return np.broadcast_to(start, (*steps.shape, 3, 3)).copy()
    result: Floats = start @ rotation_about(way, angle * steps)
    return result
