"""Shapes and moments that have closed forms, and the rod's errors in them.

The rods are practically inextensible, like those of the closed forms.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from jaxtyping import Float64
from scipy.integrate import solve_ivp
from scipy.optimize import root_scalar
from scipy.special import ellipe, ellipk

from benchmarks.physics.convergence import Case, Error
from benchmarks.physics.elasticae import ALONG_X, level_grip
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties, curvatures, moments, state_along

NODE_COUNTS = (10, 20, 40, 80, 160, 320)
"""Numbers of nodes of rods whose errors converge."""
STRETCH_STIFFNESS = 1e6
"""Stretch stiffness that makes a rod practically inextensible [N]."""
SOLVER_TOLERANCE = 1e-9
"""Tolerance of the rods [m]."""
SPAN = 0.4
"""Distance between the ends of a hanging rod [m]."""
HANGING_LENGTH = 0.6
"""Length of a hanging rod [m]."""
STRUT_ANGLE = math.radians(70.0)
"""Angle at the ends of a strut that has buckled between pins [rad]."""
STRUT = RodProperties(0.5, 0.006, 0.05, 2e6, stretch_stiffness=STRETCH_STIFFNESS)
"""Rod without weight."""
TWIST = 2.0
"""Rotation of a grip about its axis [rad]."""
NATURAL_CURVATURE = (3.0, 0.0, 4.0)
"""Rest curvature of a helix [1/m]."""


def catenary_error(bending: float, clamped: bool, node_count: int) -> Error:
    """Return mean and largest distance of the nodes of a hanging rod from the catenary [L].

    Args:
        bending: Bending stiffness EI in units of weight per length times length^3 [-].
        clamped: Whether the ends are clamped level instead of pinned.
        node_count: Number of nodes.
    """
    properties = RodProperties(
        HANGING_LENGTH, 0.004, 0.05, 1e6, stretch_stiffness=STRETCH_STIFFNESS
    )
    weight = properties.linear_density * 9.81
    properties = properties.with_stiffness(bending * weight * HANGING_LENGTH**3)
    end = "clamped" if clamped else "pinned"
    rod = Rod(properties, node_count, end, end, tolerance=SOLVER_TOLERANCE)
    rest = rod.rest(level_grip(-SPAN / 2.0), level_grip(SPAN / 2.0))
    exact = catenary(node_count)
    distances = np.linalg.norm(rest.state.positions - exact, axis=1) / HANGING_LENGTH
    return Error(float(distances.mean()), float(distances.max()))


def catenary(count: int) -> Float64[np.ndarray, "k 3"]:
    """Return points of the catenary at evenly spaced arc lengths [m]."""
    # The parameter a of z = a cosh(x / a) for which the curve is as long as the rod.
    a = root_scalar(
        lambda a: 2.0 * a * math.sinh(SPAN / (2.0 * a)) - HANGING_LENGTH,
        bracket=(0.05 * SPAN, 10.0 * SPAN),
    ).root
    s = np.linspace(-HANGING_LENGTH / 2.0, HANGING_LENGTH / 2.0, count)
    height = np.sqrt(a**2 + s**2)
    return np.stack([a * np.arcsinh(s / a), 0.0 * s, height - height[0]], axis=1)


def strut_error(node_count: int) -> Error:
    """Return mean and largest distance of the nodes of a buckled strut from Euler's elastica [L].

    The strut can turn about the line between its pins: heights over that line are compared.
    """
    distances = np.linalg.norm(strut(node_count) - elastica(node_count), axis=1) / STRUT.length
    return Error(float(distances.mean()), float(distances.max()))


def strut(node_count: int) -> Float64[np.ndarray, "n 3"]:
    """Return the nodes of a strut that has buckled between pins, turned upwards [m]."""
    rod = Rod(STRUT, node_count, "pinned", "pinned", (0.0, 0.0, 0.0), SOLVER_TOLERANCE)
    span = elastica(2)[-1, 0]
    s = np.linspace(0.0, 1.0, node_count)
    guess = np.stack([span * s, 0.0 * s, 0.3 * STRUT.length * np.sin(np.pi * s)], axis=1)
    state = state_along(guess, ALONG_X, ALONG_X, rod.model.clamps)
    nodes = rod.rest(level_grip(0.0), level_grip(span), state).state.positions
    heights = np.linalg.norm(nodes[:, 1:], axis=1)
    return np.stack([nodes[:, 0], 0.0 * heights, heights], axis=1)


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


def twisting_moment_error(node_count: int) -> Error:
    """Return the largest relative error of the moment GJ theta / L of a straight rod [-]."""
    rod = Rod(STRUT, node_count, gravity=(0.0, 0.0, 0.0), tolerance=SOLVER_TOLERANCE)
    straight = rod.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    # The grips turn in the first step; the twist spreads in the others.
    durations = np.array([0.1, 100.0, 100.0])
    actions = np.zeros((len(durations), 2, 6))
    actions[0, 1, 3] = TWIST / durations[0]
    rollout, _ = rod.settle(straight, actions, durations)
    exact = STRUT.twisting_stiffness * TWIST / STRUT.length
    return Error(float(np.max(np.abs(moments(rod, rollout.final)[:, 2] / exact - 1.0))))


def helix_error(node_count: int) -> Error:
    """Return the largest error of the curvature of a free rod that is naturally a helix [1/m]."""
    properties = RodProperties(0.5, 0.006, 0.05, 2e6, rest_curvature=(NATURAL_CURVATURE,))
    rod = Rod(
        properties, node_count, right="free", gravity=(0.0, 0.0, 0.0), tolerance=SOLVER_TOLERANCE
    )
    grip = Pose(np.zeros(3), ALONG_X)
    curvature = curvatures(rod, rod.rest(grip, grip).state)
    return Error(float(np.max(np.abs(curvature - np.array(NATURAL_CURVATURE)))))


CASES: tuple[Case, ...] = (
    Case(
        "catenary, EI = 1e-9 w L^3",
        "L",
        partial(catenary_error, 1e-9, False),
        NODE_COUNTS,
        {40: 2e-4},
        1.8,
    ),
    *(
        Case(
            f"catenary, EI = {bending:.0e} w L^3, clamped level",
            "L",
            partial(catenary_error, bending, True),
            (160,),
            {160: 0.75 * math.sqrt(bending)},
        )
        for bending in (1e-2, 1e-3, 1e-4, 1e-5)
    ),
    Case("Euler's elastica between pins", "L", strut_error, NODE_COUNTS, {40: 2e-4}, 1.8),
    Case(
        "moment of a twisted straight rod",
        "-",
        twisting_moment_error,
        (10, 40),
        {10: 1e-6, 40: 1e-6},
    ),
    Case("curvature of a natural helix", "1/m", helix_error, (10, 40), {10: 1e-6, 40: 1e-6}),
)
"""Cases of the table. As EI -> 0, the level clamps' boundary layers shrink with sqrt(EI)."""
