"""Loads at which straight rods and rings become unstable, against the theory of elasticity.

Each load is bisected by the sign of the rod's Hessian at the unbuckled shape. Loads are relative to
the exact one, so that 1 is exact.

Sources: Euler's columns and Greenhill's heavy column and twisted shaft, as in Timoshenko & Gere,
"Theory of Elastic Stability" (1961); Michell's ring (1889), found again by Zajac (1962).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from jaxtyping import Float64
from scipy.optimize import root_scalar
from scipy.special import jv

from benchmarks.physics.cases import Case
from benchmarks.physics.closed_forms import WEIGHTLESS
from benchmarks.physics.hanging import ALONG_X
from lariat.rod import Rod, RodProperties, RodState, add_turns, state_along
from lariat.rod.model import End

STEP_DURATIONS = np.full(3, 1000.0)
"""Durations of the steps without inertia in which an unbuckled shape settles [s]."""
RING_STEP_DURATIONS = np.full(6, 100.0)
"""The same for a ring, which may turn about its grip's axis: longer ones are indeterminate [s]."""
COLUMN = RodProperties(0.45, 0.008, 0.044, 1e6, stretch_stiffness=1e4, damping=0.0)
"""Rod of all cases."""
FLATNESS = 0.01
"""Extent out of its plane above which a ring has buckled, in lengths [-].

The bends beside the grip make a ring of n nodes leave its plane by about 1 / (2 n^2) before."""
TANGENT_ROOT = root_scalar(lambda x: x - math.tan(x), bracket=(4.4, 4.6)).root
"""First positive root of x = tan(x)."""

Stable = Callable[[float], bool]
"""Stability of the unbuckled shape under a load relative to the exact critical one."""


def error(unbuckled: Callable[[int], Stable], node_count: int) -> float:
    """Return the relative error of the critical load [%]."""
    stable = unbuckled(node_count)
    low, high = 0.5, 1.5
    for _ in range(22):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return 100.0 * abs(0.5 * (low + high) - 1.0)


def compressed(left: End, right: End, exact: float, node_count: int) -> Stable:
    """Return the stability of a straight rod that is shortened between its ends."""
    rod = Rod(COLUMN, node_count, left, right, WEIGHTLESS, 1e-9)
    straight = rod.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    strain = exact * COLUMN.bending_stiffness / COLUMN.length**2 / COLUMN.stretch_stiffness
    return lambda load: _settles(
        rod, replace(straight, positions=(1.0 - load * strain) * straight.positions)
    )


def loaded_tip(node_count: int) -> Stable:
    """Return the stability of a column with a free tip that carries a weight: pi^2 / 4 EI / L^2.

    The weight is the mass of the last node; the rest of the column has next to none.
    """
    profile = (1e-9,) * (node_count - 1) + (1.0,)
    properties = replace(COLUMN, density_profile=profile)
    mass = 0.5 * properties.linear_density * properties.length / (node_count - 1)
    exact = 0.25 * math.pi**2 * properties.bending_stiffness / properties.length**2
    return partial(_upright, properties, node_count, exact / mass)


def heavy_column(node_count: int) -> Stable:
    """Return the stability of a column with a free tip under its own weight.

    The exact critical weight per length is 9 j^2 / 4 EI / L^3, with j the first zero of the Bessel
    function of order -1/3.
    """
    j = root_scalar(lambda j: jv(-1.0 / 3.0, j), bracket=(1.8, 1.9)).root
    exact = 2.25 * j**2 * COLUMN.bending_stiffness / COLUMN.length**3
    return partial(_upright, COLUMN, node_count, exact / COLUMN.linear_density)


def twisted(node_count: int) -> Stable:
    """Return the stability of a straight rod, twisted between clamps: 2 x EI / L, x = tan(x)."""
    rod = Rod(COLUMN, node_count, gravity=WEIGHTLESS, tolerance=1e-9)
    straight = rod.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    exact = 2.0 * TANGENT_ROOT * COLUMN.bending_stiffness / COLUMN.twisting_stiffness
    return lambda load: _settles(rod, add_turns(straight, load * exact / (2.0 * math.pi)))


def ring(node_count: int) -> Stable:
    """Return the stability of a ring that is cut, twisted and closed; both ends have one grip.

    The exact critical twist is 2 pi sqrt(3) EI / GJ.
    """
    rod = Rod(COLUMN, node_count, gravity=WEIGHTLESS, tolerance=1e-9)
    edges = node_count - 1
    angles = 2.0 * np.pi * (np.arange(edges) + 0.5) / edges
    tangents = np.stack([np.cos(angles), 0.0 * angles, np.sin(angles)], axis=1)
    nodes = rod.edge_length * np.concatenate([np.zeros((1, 3)), np.cumsum(tangents, axis=0)])
    untwisted = state_along(nodes, ALONG_X, ALONG_X, rod.model.clamps)
    exact = math.sqrt(3.0) * COLUMN.bending_stiffness / COLUMN.twisting_stiffness
    return lambda load: _settles(rod, add_turns(untwisted, load * exact), RING_STEP_DURATIONS)


def _upright(properties: RodProperties, node_count: int, gravity: float, load: float) -> bool:
    """Return whether a column that is clamped at its foot stands upright."""
    rod = Rod(properties, node_count, right="free", gravity=(0.0, 0.0, -load * gravity))
    return _settles(rod, rod.straight((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)))


def _settles(
    rod: Rod, state: RodState, durations: Float64[np.ndarray, "H"] = STEP_DURATIONS
) -> bool:
    """Return whether a rod in the plane y = 0 settles there into a stable shape."""
    rollout, stable = rod.settle(state, np.zeros((len(durations), 2, 6)), durations)
    flat = np.ptp(rollout.positions[-1][:, 1]) < FLATNESS * rod.properties.length
    return bool(stable and flat and rollout.converged.all())


CASES = tuple(
    Case(name, "%", partial(error, unbuckled), counts, {40: 1.0}, 1.8)
    for name, unbuckled, counts in (
        *(
            (name, unbuckled, (10, 20, 40, 80, 160))
            for name, unbuckled in (
                ("Euler, clamped", partial(compressed, "clamped", "clamped", 4.0 * math.pi**2)),
                (
                    "Euler, clamped and pinned",
                    partial(compressed, "clamped", "pinned", TANGENT_ROOT**2),
                ),
                ("Euler, pinned", partial(compressed, "pinned", "pinned", math.pi**2)),
                ("Euler, clamped and free", loaded_tip),
                ("Greenhill, heavy column", heavy_column),
                ("Greenhill, twisted shaft", twisted),
            )
        ),
        ("Michell, twisted ring", ring, (20, 40, 80, 160)),
    )
)
