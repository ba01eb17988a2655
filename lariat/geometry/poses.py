"""Rotations and rigid poses.

Conventions: quaternions are wxyz with unit norm; `T_a_b` maps coordinates of frame b to frame a;
angular velocities are in the world frame.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
"""Quaternion of the identity rotation."""
SMALL_BATCH = 64
"""Rows up to which a product is one tensor contraction, which needs fewer calls of NumPy."""


def _product_table(size: int, terms: str) -> Float64[np.ndarray, "pairs size"]:
    """Return structure constants of a bilinear product, as a matrix over component pairs."""
    table = np.zeros((size, size, size))
    for sign, i, j, k in terms.split():
        table[int(i), int(j), int(k)] = 1.0 if sign == "+" else -1.0
    return table.reshape(size * size, size)


_CROSS_TABLE = _product_table(3, "+120 -210 +201 -021 +012 -102")
"""Structure constants of the cross product."""
_CONJUGATION = np.array([1.0, -1.0, -1.0, -1.0])
"""Signs of the components of a conjugate."""
_HAMILTON_TABLE = _product_table(
    4,
    "+000 -110 -220 -330 +011 +101 +231 -321 +022 -132 +202 +312 +033 +123 -213 +303",
)
"""Structure constants of the Hamilton product."""


def _product(a: np.ndarray, b: np.ndarray, table: np.ndarray) -> np.ndarray:
    pairs = a[..., :, None] * b[..., None, :]
    return pairs.reshape(*pairs.shape[:-2], len(table)) @ table


def _cross(
    ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> tuple[float, float, float]:
    """Return the cross product of two vectors; without NumPy it takes a fifth of the time."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def _hamilton(
    aw: float, ax: float, ay: float, az: float, bw: float, bx: float, by: float, bz: float
) -> tuple[float, float, float, float]:
    """Return the Hamilton product of two quaternions."""
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def _rotated(
    w: float, qx: float, qy: float, qz: float, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Return R(q) v."""
    once = _cross(qx, qy, qz, x, y, z)
    along, across, up = _cross(qx, qy, qz, *once)
    return (
        x + 2.0 * (w * once[0] + along),
        y + 2.0 * (w * once[1] + across),
        z + 2.0 * (w * once[2] + up),
    )


def normalized(q: Float64[np.ndarray, "*b k"]) -> Float64[np.ndarray, "*b k"]:
    """Return vectors or quaternions scaled to unit norm."""
    # `numpy.linalg.norm` has the same bits and takes twice as long for few rows.
    return q / np.sqrt(np.add.reduce(q * q, axis=-1, keepdims=True))


def cross(
    a: Float64[np.ndarray, "*b 3"], b: Float64[np.ndarray, "*b 3"]
) -> Float64[np.ndarray, "*b 3"]:
    """Return a x b; for few rows several times as fast as `numpy.cross`."""
    if a.ndim == b.ndim == 1:
        return np.array(_cross(*a.tolist(), *b.tolist()))
    if a.size <= 3 * SMALL_BATCH and b.size <= 3 * SMALL_BATCH:
        return _product(a, b, _CROSS_TABLE)
    return a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]]


def multiply(
    a: Float64[np.ndarray, "*b 4"], b: Float64[np.ndarray, "*b 4"]
) -> Float64[np.ndarray, "*b 4"]:
    """Return the Hamilton product a b: rotation b followed by rotation a."""
    a, b = np.asarray(a), np.asarray(b)
    if a.ndim == b.ndim == 1:
        return np.array(_hamilton(*a.tolist(), *b.tolist()))
    if a.size <= 4 * SMALL_BATCH and b.size <= 4 * SMALL_BATCH:
        return _product(a, b, _HAMILTON_TABLE)
    left, right = ([q[..., k] for k in range(4)] for q in (a, b))
    return np.stack(_hamilton(*left, *right), axis=-1)


def conjugate(q: Float64[np.ndarray, "*b 4"]) -> Float64[np.ndarray, "*b 4"]:
    """Return the inverse rotation of a unit quaternion."""
    return np.asarray(q) * _CONJUGATION


def rotate(
    q: Float64[np.ndarray, "*b 4"], v: Float64[np.ndarray, "*b 3"]
) -> Float64[np.ndarray, "*b 3"]:
    """Return R(q) v, for a unit quaternion q."""
    q, v = np.asarray(q), np.asarray(v)
    if q.ndim == v.ndim == 1:
        return np.array(_rotated(*q.tolist(), *v.tolist()))
    axis = q[..., 1:]
    t = 2.0 * cross(axis, v)
    return v + q[..., :1] * t + cross(axis, t)


def matrix(q: Float64[np.ndarray, "*b 4"]) -> Float64[np.ndarray, "*b 3 3"]:
    """Return the rotation matrix of a unit quaternion."""
    q = np.asarray(q)
    return np.stack([rotate(q, np.broadcast_to(e, (*q.shape[:-1], 3))) for e in np.eye(3)], axis=-1)


def from_matrix(R: Float64[np.ndarray, "3 3"]) -> Float64[np.ndarray, "4"]:
    """Return the unit quaternion of a rotation matrix, with w >= 0.

    Shepperd, "Quaternion from rotation matrix", J. Guidance and Control 1 (1978).
    """
    (a, b, c), (d, e, f), (g, h, i) = R.tolist()
    largest = max(a + e + i, a, e, i)
    # A list: for four numbers, NumPy takes several times as long.
    if largest == a + e + i:
        q = [1.0 + largest, h - f, c - g, d - b]
    elif largest == a:
        q = [h - f, 1.0 + a - e - i, b + d, c + g]
    elif largest == e:
        q = [c - g, d + b, 1.0 + e - i - a, f + h]
    else:
        q = [d - b, g + c, h + f, 1.0 + i - a - e]
    norm = math.copysign(math.hypot(*q), q[0] or 1.0)
    return np.array([value / norm for value in q])


def roll_pitch_yaw(R: Float64[np.ndarray, "3 3"]) -> tuple[float, float, float]:
    """Return the angles about the fixed axes x, y, z of a rotation matrix [rad], as in a URDF.

    Where the pitch is a quarter turn, roll and yaw turn about the same axis, and the roll is zero.
    """
    (a, b, _), (c, d, _), (e, f, g) = R.tolist()
    level = math.hypot(a, c)
    pitch = math.atan2(-e, level)
    if level < 1e-9:
        return 0.0, pitch, math.atan2(-b, d)
    return math.atan2(f, g), pitch, math.atan2(c, a)


def exponential(rotation_vector: Float64[np.ndarray, "*b 3"]) -> Float64[np.ndarray, "*b 4"]:
    """Return the unit quaternion of a rotation vector [rad]."""
    v = np.asarray(rotation_vector, dtype=np.float64)
    half = 0.5 * np.sqrt(np.einsum("...i,...i->...", v, v))[..., None]
    # The steps of `numpy.sinc`, with the same bits, in a third of its time.
    angle = np.pi * (half / np.pi)
    angle = np.where(angle, angle, 1e-20)
    return np.concatenate([np.cos(half), 0.5 * (np.sin(angle) / angle) * v], axis=-1)


def logarithm(q: Float64[np.ndarray, "*b 4"]) -> Float64[np.ndarray, "*b 3"]:
    """Return the rotation vector of a unit quaternion, of norm at most pi [rad]."""
    q = np.asarray(q)
    if (backwards := q[..., :1] < 0.0).any():
        q = np.where(backwards, -q, q)
    vector = q[..., 1:]
    sine = np.sqrt(np.einsum("...i,...i->...", vector, vector))[..., None]
    angle = 2.0 * np.arctan2(sine, q[..., :1])
    scale = np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0)
    return scale * vector


def turned(
    rotation_vectors: Float64[np.ndarray, "*b 3"], q: Float64[np.ndarray, "*#b 4"]
) -> Float64[np.ndarray, "*b 4"]:
    """Return unit quaternions rotated by rotation vectors in the world frame [rad]."""
    if not rotation_vectors.any():
        # Grips that only move are the usual case.
        return np.broadcast_to(normalized(q), (*rotation_vectors.shape[:-1], 4))
    return normalized(multiply(exponential(rotation_vectors), q))


def rotation_from(
    before: Float64[np.ndarray, "*b 4"], after: Float64[np.ndarray, "*b 4"]
) -> Float64[np.ndarray, "*b 3"]:
    """Return the rotation vectors in the world frame that turn unit quaternions into others."""
    if np.array_equal(before, after):
        return np.zeros((*after.shape[:-1], 3))
    return logarithm(multiply(after, conjugate(before)))


def rotation_between(
    a: Float64[np.ndarray, "*b 3"], b: Float64[np.ndarray, "*b 3"]
) -> Float64[np.ndarray, "*b 4"]:
    """Return the smallest rotation that turns unit vector `a` into unit vector `b`.

    For opposite vectors the axis is one of those perpendicular to `a`.
    """
    w = 1.0 + np.add.reduce(a * b, axis=-1, keepdims=True)
    q = np.concatenate([w, cross(a, b)], axis=-1)
    if not (w > 1e-9).all():
        a, _ = np.broadcast_arrays(a, b)
        least = np.eye(3)[np.argmin(np.abs(a), axis=-1)]
        opposite = np.concatenate([np.zeros_like(w), cross(a, least)], axis=-1)
        q = np.where(w > 1e-9, q, opposite)
    return normalized(q)


def slerp(
    a: Float64[np.ndarray, "4"], b: Float64[np.ndarray, "4"], t: float
) -> Float64[np.ndarray, "4"]:
    """Return the spherical linear interpolation from `a` at t = 0 to `b` at t = 1."""
    return multiply(a, exponential(t * logarithm(multiply(conjugate(a), b))))


@dataclass(frozen=True)
class Pose:
    """Rigid transformation between frames: x_outer = R(orientation) x_inner + position."""

    position: Float64[np.ndarray, "3"]
    """Origin of the inner frame in the outer one [m]."""
    orientation: Float64[np.ndarray, "4"]
    """Unit quaternion wxyz, inner to outer."""

    def __matmul__(self, other: Pose) -> Pose:
        """Return the composition T_a_c = T_a_b @ T_b_c."""
        q, (x, y, z) = self.orientation.tolist(), self.position.tolist()
        a, b, c = _rotated(*q, *other.position.tolist())
        turned = _hamilton(*q, *other.orientation.tolist())
        return Pose(np.array([a + x, b + y, c + z], float), np.array(turned, float))

    def apply(self, points: Float64[np.ndarray, "*b 3"]) -> Float64[np.ndarray, "*b 3"]:
        """Return points of the inner frame in the outer one [m]."""
        return rotate(self.orientation, np.asarray(points, float)) + self.position

    def inverse(self) -> Pose:
        """Return T_b_a of T_a_b."""
        back = conjugate(self.orientation)
        return Pose(-rotate(back, self.position), back)


def pose_difference(a: Pose, b: Pose) -> tuple[float, float]:
    """Return distance and angle between two poses [m, rad]."""
    turn = angle_between(a.orientation.tolist(), b.orientation.tolist())
    return math.dist(a.position.tolist(), b.position.tolist()), turn


def angle_between(a: Sequence[float], b: Sequence[float]) -> float:
    """Return the angle between two orientations, unit quaternions wxyz [rad]."""
    w, x, y, z = a
    w, x, y, z = _hamilton(*b, w, -x, -y, -z)
    return 2.0 * math.atan2(math.hypot(x, y, z), abs(w))


def interpolate(a: Pose, b: Pose, t: float) -> Pose:
    """Return the pose between `a` at t = 0 and `b` at t = 1: linear in position, slerp in rotation.

    Args:
        a: First pose.
        b: Second pose, in the same frame.
        t: Interpolation parameter, 0..1.
    """
    return Pose((1.0 - t) * a.position + t * b.position, slerp(a.orientation, b.orientation, t))
