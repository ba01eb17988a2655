"""Jacobian of the exponential map of SO(3)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import cross


def left_jacobian(
    y: Float64[np.ndarray, "m 3"], v: Float64[np.ndarray, "*b m 3"]
) -> Float64[np.ndarray, "*b m 3"]:
    """Return J_l(y) v, where exp(y + dy) = exp(J_l(y) dy) exp(y); it is also J_r(y)^T v.

    Closed form as in Solà, Deray & Atchuthan, "A micro Lie theory for state estimation in
    robotics" (2018), eq. (145), with its Taylor series near zero.

    Args:
        y: Rotation vectors [rad].
        v: Vectors to map.
    """
    t = np.linalg.norm(y, axis=1, keepdims=True)
    small = t < 1e-4
    safe = np.where(small, 1.0, t)
    a = np.where(small, 0.5 - t**2 / 24.0, (1.0 - np.cos(safe)) / safe**2)
    b = np.where(small, 1.0 / 6.0, (safe - np.sin(safe)) / safe**3)
    y_v = cross(y, v)
    return v + a * y_v + b * cross(y, y_v)
