"""Table of the parameters of a rope that are identified.

The offline fit, the online filter, messages, scenarios, tables and charts iterate it. A parameter
is added as a row here, as a field of `RodProperties`, and as an estimate of the message
`RodParameters`. The table needs no rod, because processes that have none check and show messages.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from math import log, radians
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float64


class Values(Enum):
    """Values of a parameter, and the unknowns that stand for them."""

    SCALAR = "scalar"
    """One value; the unknown is the logarithm of its ratio to the prior mean [-]."""
    FACTORS = "factors"
    """Factors at the knots of a profile; the unknowns are their logarithms [-]."""
    CURVATURE = "curvature"
    """Three components at each knot; the unknowns are these times the length of the rope [rad]."""
    GRIPS = "grips"
    """Three components for each grip, left before right, which are the unknowns themselves."""


class Prior(NamedTuple):
    """Normal distribution of zero mean of each unknown, and its limit."""

    deviation: float
    """Standard deviation [unit of the unknown]."""
    limit: float
    """Largest magnitude [unit of the unknown]; zero keeps the given value."""


@dataclass(frozen=True)
class RopeParameter:
    """Row of the table."""

    name: str
    """Name in messages, tables and charts; of a property of the rod, that of its attribute."""
    unit: str
    """Unit of the value."""
    values: Values
    """Number of values, and meaning of the unknowns."""
    filter_prior: Prior
    """Prior of the online filter, about the given rope."""
    bounds: tuple[float, float]
    """Least and largest value in a message [`unit`]."""
    fit_prior: Prior = Prior(0.0, 0.0)
    """Prior of the offline fit, which does not know how the grips hold the rope."""
    published: bool = True
    """Whether the message `RodParameters` has it."""
    scaled: tuple[str, ...] = ()
    """Parameters of the kernels that are proportional to it; by default the one of its name."""
    short_windows: bool = False
    """Whether short windows of a motion determine it."""
    follows_history: bool = False
    """Whether a shape shows it by how the rope came there, swinging or touching, alone."""
    per_density: tuple[str, str] | None = None
    """Name and unit of its ratio to the linear density, where motion determines that alone."""

    def label(self, number: int) -> str:
        """Return the words for one of its values.

        Args:
            number: Number of the value, from 1.
        """
        words, (vector, axis) = self.name.replace("_", " "), divmod(number - 1, 3)
        match self.values:
            case Values.SCALAR:
                return words
            case Values.FACTORS:
                return f"{words}, knot {number}"
            case Values.CURVATURE:
                return f"{words} about {('d1', 'd2', 'd3')[axis]}, knot {vector + 1}"
            case Values.GRIPS:
                return f"{words}, {('left', 'right')[vector]} {'xyz'[axis]}"

    def of(self, properties: Any) -> Float64[np.ndarray, "k"]:
        """Return its values in `RodProperties` [`unit`]."""
        return np.ravel(np.asarray(getattr(properties, self.name), float))

    def attribute(self, values: Sequence[float]) -> Any:
        """Return values as the attribute of `RodProperties` holds them."""
        match self.values:
            case Values.SCALAR:
                return values[0]
            case Values.FACTORS:
                return tuple(values)
            case Values.CURVATURE | Values.GRIPS:
                return tuple(tuple(row) for row in np.reshape(values, (-1, 3)).tolist())


ROPE_PARAMETERS = (
    # Motion does not change when mass and stiffness are scaled together.
    RopeParameter(
        "bending_stiffness",
        "N m^2",
        Values.SCALAR,
        filter_prior=Prior(1.5, log(50.0)),
        fit_prior=Prior(4.0, 12.0),
        bounds=(1e-9, 1e6),
        scaled=("bending_stiffness", "twisting_stiffness"),
        short_windows=True,
        per_density=("stiffness", "m^4/s^2"),
    ),
    RopeParameter(
        "twist_ratio",
        "-",
        Values.SCALAR,
        filter_prior=Prior(0.7, log(8.0)),
        fit_prior=Prior(1.0, 3.0),
        bounds=(1e-3, 1e3),
        scaled=("twisting_stiffness",),
    ),
    RopeParameter(
        "damping",
        "1/s",
        Values.SCALAR,
        filter_prior=Prior(0.7, log(20.0)),
        fit_prior=Prior(1.5, 5.0),
        bounds=(0.0, 1e6),
        short_windows=True,
        follows_history=True,
    ),
    RopeParameter(
        "internal_damping",
        "s",
        Values.SCALAR,
        filter_prior=Prior(1e-3, 0.0),
        fit_prior=Prior(1.5, 5.0),
        bounds=(0.0, 1e6),
        published=False,
        short_windows=True,
        follows_history=True,
    ),
    RopeParameter(
        "drag_coefficient",
        "-",
        Values.SCALAR,
        filter_prior=Prior(0.5, log(5.0)),
        fit_prior=Prior(0.7, 3.0),
        bounds=(0.0, 1e3),
        follows_history=True,
        per_density=("drag_coefficient_per_density", "m/kg"),
    ),
    RopeParameter(
        "length",
        "m",
        Values.SCALAR,
        filter_prior=Prior(0.008, 0.03),
        fit_prior=Prior(0.02, 0.1),
        bounds=(1e-3, 1e3),
        short_windows=True,
    ),
    RopeParameter(
        "stiffness_profile",
        "-",
        Values.FACTORS,
        filter_prior=Prior(0.2, log(4.0)),
        fit_prior=Prior(0.5, 2.0),
        bounds=(1e-6, 1e6),
    ),
    RopeParameter(
        "density_profile",
        "-",
        Values.FACTORS,
        filter_prior=Prior(1e-3, 0.0),
        fit_prior=Prior(0.3, 1.5),
        bounds=(1e-6, 1e6),
        published=False,
    ),
    RopeParameter(
        "rest_curvature",
        "1/m",
        Values.CURVATURE,
        filter_prior=Prior(0.5, 3.0),
        fit_prior=Prior(3.0, 100.0),
        bounds=(-1e4, 1e4),
        short_windows=True,
    ),
    RopeParameter(
        "yield_curvature",
        "1/m",
        Values.SCALAR,
        filter_prior=Prior(0.4, log(4.0)),
        fit_prior=Prior(0.7, 3.0),
        bounds=(1e-3, 1e6),
        follows_history=True,
    ),
    RopeParameter(
        "friction_factor",
        "-",
        Values.SCALAR,
        filter_prior=Prior(0.7, log(5.0)),
        fit_prior=Prior(0.7, 3.0),
        bounds=(1e-3, 1e3),
        follows_history=True,
    ),
    RopeParameter(
        "grip_offset",
        "m",
        Values.GRIPS,
        filter_prior=Prior(2e-3, 0.01),
        bounds=(-0.1, 0.1),
    ),
    RopeParameter(
        "grip_rotation",
        "rad",
        Values.GRIPS,
        filter_prior=Prior(radians(1.5), radians(8.0)),
        bounds=(-3.2, 3.2),
    ),
)
"""All parameters, in the order of the unknowns and of tables."""
MATERIAL = tuple(p for p in ROPE_PARAMETERS if p.values is not Values.GRIPS)
"""Parameters that are properties of the rope."""
PUBLISHED = tuple(p for p in ROPE_PARAMETERS if p.published)
"""Parameters of the message `RodParameters`."""
BY_NAME = {p.name: p for p in ROPE_PARAMETERS}
"""Rows by name."""
