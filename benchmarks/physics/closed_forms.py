"""Closed-form solutions: elasticas by shooting, elliptic integrals, roots."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from jaxtyping import Float64


def heavy_elastica(
    load: float, length: float, s: Float64[np.ndarray, "m"]
) -> Float64[np.ndarray, "m 2"]:
    """x and z of a heavy cantilever: theta'' = load (length - s) cos(theta).

    theta(0) = 0 and theta'(length) = 0, with theta measured upwards; solved by shooting on
    theta'(0) and the Runge-Kutta method of fourth order.

    Args:
        load: Weight per length over bending stiffness [1/m^3].
        length: Length of the cantilever [m].
        s: Arc lengths from the clamp [m].
    """

    def shot(slope: float) -> Float64[np.ndarray, "k 4"]:
        return elastica(
            0.0, slope, lambda at, theta: load * (length - at) * math.cos(theta), length
        )

    # The secant method: the moment at the tip grows with the slope at the clamp.
    old, new = -0.5 * load * length**2, -0.3 * load * length**2
    value_old, value_new = shot(old)[-1, 3], shot(new)[-1, 3]
    for _ in range(40):
        if abs(value_new) < 1e-12 * load:
            break
        old, new, value_old = (
            new,
            new - value_new * (new - old) / (value_new - value_old),
            value_new,
        )
        value_new = shot(new)[-1, 3]
    path = shot(new)
    at = np.linspace(0.0, length, len(path))
    return np.stack([np.interp(s, at, path[:, k]) for k in range(2)], axis=1)


def elastica(
    angle: float,
    slope: float,
    bending: Callable[[float, float], float],
    length: float = 1.0,
    steps: int = 4000,
) -> Float64[np.ndarray, "k 4"]:
    """x, z, theta and theta' along a curve with theta'' = bending(s, theta).

    Args:
        angle: theta(0) [rad].
        slope: theta'(0) [rad/m].
        bending: theta'' at arc length and angle [rad/m^2].
        length: Length of the curve [m].
        steps: Number of steps of the Runge-Kutta method of fourth order.
    """
    h = length / steps

    def rate(at: float, y: Float64[np.ndarray, "4"]) -> Float64[np.ndarray, "4"]:
        return np.array([math.cos(y[2]), math.sin(y[2]), y[3], bending(at, y[2])])

    y = np.array([0.0, 0.0, angle, slope])
    path = [y]
    for k in range(steps):
        k1 = rate(k * h, y)
        k2 = rate((k + 0.5) * h, y + 0.5 * h * k1)
        k3 = rate((k + 0.5) * h, y + 0.5 * h * k2)
        k4 = rate((k + 1) * h, y + h * k3)
        y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        path.append(y)
    return np.array(path)


def elliptic(k: float) -> tuple[float, float]:
    """Complete elliptic integrals K and E of modulus k, by the arithmetic-geometric mean."""
    a, g, total, power = 1.0, math.sqrt(1.0 - k * k), 0.5 * k * k, 0.5
    while abs(a - g) > 1e-15:
        a, g, c = (a + g) / 2.0, math.sqrt(a * g), (a - g) / 2.0
        power *= 2.0
        total += power * c * c
    first = math.pi / (2.0 * a)
    return first, first * (1.0 - total)


def root(function: Callable[[float], float], low: float, high: float) -> float:
    """Root of a function that is negative at `low` and positive at `high`, by bisection."""
    for _ in range(200):
        middle = 0.5 * (low + high)
        if function(middle) < 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
