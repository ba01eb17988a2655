"""Young's modulus identified from exact shapes: points of the continuum between known clamps.

The rod's rest shape is fitted to them by least squares in Young's modulus, with all else
known. What is left is the error of the discretization, as a stiffness.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from jaxtyping import Float64
from scipy.optimize import least_squares

from benchmarks.physics.convergence import Case, Error
from benchmarks.physics.elasticae import CLAMPED_ROPES, HeldRope

NODE_COUNTS = (30, 40, 80)
"""Numbers of nodes of the fitted rods."""
START_FACTOR = 2.0
"""Young's modulus from which the fit starts, relative to the true one [-]."""
FIT_TOLERANCE = 1e-6
"""Relative change of Young's modulus at which the fit ends [-]."""
FACTOR_RANGE = (0.1, 10.0)
"""Bounds of the fit, relative to the true one [-]."""
DIFFERENCE = 1e-3
"""Step of the finite difference, relative to Young's modulus [-]."""


SHAPES: tuple[HeldRope, ...] = tuple(
    CLAMPED_ROPES[name]
    for name in (
        "0.24 m apart",
        "0.12 m apart",
        "0.36 m apart",
        "pitched",
        "yawed",
        "right end 0.1 m higher",
    )
)
"""Shapes that are fitted together."""


def error(ropes: tuple[HeldRope, ...], node_count: int) -> Error:
    """Return the relative error of the Young's modulus that fits the shapes best [%]."""
    exact = [rope.continuum.positions(node_count) for rope in ropes]

    def residuals(factor: Float64[np.ndarray, "1"]) -> Float64[np.ndarray, "k"]:
        fitted = [_scaled(rope, factor[0]).rest(node_count).state.positions for rope in ropes]
        return np.ravel(fitted) - np.ravel(exact)

    fit = least_squares(
        residuals,
        [START_FACTOR],
        bounds=FACTOR_RANGE,
        diff_step=DIFFERENCE,
        ftol=None,
        xtol=FIT_TOLERANCE,
        gtol=None,
    )
    return Error(100.0 * abs(fit.x[0] - 1.0))


def _scaled(rope: HeldRope, factor: float) -> HeldRope:
    """Return the same rope with another Young's modulus."""
    modulus = factor * rope.properties.youngs_modulus
    return replace(rope, properties=replace(rope.properties, youngs_modulus=modulus))


def _case(name: str, ropes: tuple[HeldRope, ...], bounds: tuple[float, ...]) -> Case:
    return Case(
        name,
        "%",
        partial(error, ropes),
        NODE_COUNTS,
        dict(zip(NODE_COUNTS, bounds, strict=False)),
    )


_SOFT = tuple(_scaled(rope, 0.25) for rope in SHAPES)
_STIFF = tuple(_scaled(rope, 4.0) for rope in SHAPES)
CASES: tuple[Case, ...] = (
    _case("0.24 m apart", SHAPES[:1], (2.0, 2.0, 2.0)),
    _case("0.24 m apart, E / 4", _SOFT[:1], ()),
    _case("0.24 m apart, E x 4", _STIFF[:1], ()),
    _case("six shapes together", SHAPES, (2.0, 2.0, 2.0)),
    _case("six shapes together, E / 4", _SOFT, (3.0, 2.0, 2.0)),
    _case("six shapes together, E x 4", _STIFF, (2.0, 2.0, 2.0)),
)
"""Cases of the table. One shape of a stiff rope hardly tells its stiffness: it has no bound."""
