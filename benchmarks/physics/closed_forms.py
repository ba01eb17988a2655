"""Shapes and moments that have closed forms, and the errors of practically inextensible rods."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float64
from scipy.integrate import solve_ivp
from scipy.optimize import root_scalar
from scipy.special import ellipe, ellipk

from benchmarks.physics.cases import Case
from benchmarks.physics.hanging import ALONG_X, level_grip
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties, curvatures, moments, state_along

WEIGHTLESS = (0.0, 0.0, 0.0)
"""Absence of gravity [m/s^2]."""
SPAN, HANGING_LENGTH = 0.4, 0.6
"""Distance between the ends of a hanging rod, and its length [m]."""
STRUT_ANGLE = math.radians(70.0)
"""Angle at the ends of a strut that has buckled between pins [rad]."""
STRUT = RodProperties(0.5, 0.006, 0.05, 2e6, stretch_stiffness=1e6)
TWIST = 2.0
"""Rotation of a grip about its axis [rad]."""
NATURAL_CURVATURE = (3.0, 0.0, 4.0)
"""Rest curvature of a helix [1/m]."""


def catenary_error(node_count: int) -> float:
    """Return the mean distance of a hanging rod of EI = 1e-9 w L^3 from the catenary [L]."""
    properties = RodProperties(HANGING_LENGTH, 0.004, 0.05, 1e6, stretch_stiffness=1e6)
    weight = properties.linear_density * 9.81
    properties = properties.with_stiffness(1e-9 * weight * HANGING_LENGTH**3)
    rod = Rod(properties, node_count, "pinned", "pinned", tolerance=1e-9)
    nodes = rod.rest(level_grip(-SPAN / 2.0), level_grip(SPAN / 2.0)).state.positions
    # The parameter a of z = a cosh(x / a) for which the curve is as long as the rod.
    a = root_scalar(
        lambda a: 2.0 * a * math.sinh(SPAN / (2.0 * a)) - HANGING_LENGTH,
        bracket=(0.05 * SPAN, 10.0 * SPAN),
    ).root
    s = np.linspace(-HANGING_LENGTH / 2.0, HANGING_LENGTH / 2.0, node_count)
    height = np.sqrt(a**2 + s**2)
    exact = np.stack([a * np.arcsinh(s / a), 0.0 * s, height - height[0]], axis=1)
    return float(np.mean(np.linalg.norm(nodes - exact, axis=1) / HANGING_LENGTH))


def strut_error(node_count: int) -> float:
    """Return the mean distance of a strut, buckled between pins, from the elastica [L].

    The strut can turn about the line between its pins: heights over that line are compared.
    """
    rod = Rod(STRUT, node_count, "pinned", "pinned", WEIGHTLESS, 1e-9)
    span = elastica(2)[-1, 0]
    s = np.linspace(0.0, 1.0, node_count)
    guess = np.stack([span * s, 0.0 * s, 0.3 * STRUT.length * np.sin(np.pi * s)], axis=1)
    state = state_along(guess, ALONG_X, ALONG_X, rod.model.clamps)
    nodes = rod.rest(level_grip(0.0), level_grip(span), state).state.positions
    heights = np.linalg.norm(nodes[:, 1:], axis=1)
    upright = np.stack([nodes[:, 0], 0.0 * heights, heights], axis=1)
    return float(np.mean(np.linalg.norm(upright - elastica(node_count), axis=1) / STRUT.length))


def elastica(count: int) -> Float64[np.ndarray, "k 3"]:
    """Return points of Euler's elastica between pins at evenly spaced arc lengths [m].

    theta'' = -(2 K(k) / L)^2 sin(theta) with k = sin(theta(0) / 2); its span is
    L (2 E(k) / K(k) - 1).
    """
    m = math.sin(STRUT_ANGLE / 2.0) ** 2
    rate = (2.0 * ellipk(m)) ** 2

    def derivatives(_: float, y: Float64[np.ndarray, "4"]) -> list[float]:
        return [math.cos(y[2]), math.sin(y[2]), y[3], -rate * math.sin(y[2])]

    s = np.linspace(0.0, 1.0, count)
    path = solve_ivp(
        derivatives, (0.0, 1.0), [0.0, 0.0, STRUT_ANGLE, 0.0], "DOP853", s, rtol=1e-12, atol=1e-12
    ).y
    span = 2.0 * ellipe(m) / ellipk(m) - 1.0
    assert abs(path[0, -1] - span) < 1e-9
    return STRUT.length * np.stack([path[0], 0.0 * s, path[1]], axis=1)


def twisting_moment_error(node_count: int) -> float:
    """Return the largest relative error of the moment GJ theta / L of a straight rod [-]."""
    rod = Rod(STRUT, node_count, gravity=WEIGHTLESS, tolerance=1e-9)
    # The grips turn in the first step; the twist spreads in the others.
    durations = np.array([0.1, 100.0, 100.0])
    actions = np.zeros((len(durations), 2, 6))
    actions[0, 1, 3] = TWIST / durations[0]
    straight = rod.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    rollout, _ = rod.settle(straight, actions, durations)
    exact = STRUT.twisting_stiffness * TWIST / STRUT.length
    return float(np.max(np.abs(moments(rod, rollout.final)[:, 2] / exact - 1.0)))


def helix_error(node_count: int) -> float:
    """Return the largest error of the curvature of a free rod that is naturally a helix [1/m]."""
    properties = RodProperties(0.5, 0.006, 0.05, 2e6, rest_curvature=(NATURAL_CURVATURE,))
    rod = Rod(properties, node_count, right="free", gravity=WEIGHTLESS, tolerance=1e-9)
    grip = Pose(np.zeros(3), ALONG_X)
    curvature = curvatures(rod, rod.rest(grip, grip).state)
    return float(np.max(np.abs(curvature - np.array(NATURAL_CURVATURE))))


COUNTS = (10, 20, 40, 80, 160, 320)
EXACT = {10: 1e-6, 40: 1e-6}
CASES: tuple[Case, ...] = (
    Case("catenary, EI = 1e-9 w L^3", "L", catenary_error, COUNTS, {40: 2e-4}, 1.8),
    Case("Euler's elastica between pins", "L", strut_error, COUNTS, {40: 2e-4}, 1.8),
    Case("moment of a twisted straight rod", "-", twisting_moment_error, (10, 40), EXACT),
    Case("curvature of a natural helix", "1/m", helix_error, (10, 40), EXACT),
)
