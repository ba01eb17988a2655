"""Colours of the drawing: red, green, blue, alpha [-]."""

from __future__ import annotations

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from jaxtyping import Float64

RgbaArray = Float64[np.ndarray, "n 4"]
"""Colours of points."""

ROPE = (1.0, 0.62, 0.1, 1.0)
UNCERTAIN_ROPE = (0.8, 0.0, 0.9, 1.0)
"""Rope where the standard deviation of its position is `FULL_SIGMA` or more."""
FULL_SIGMA = 2e-3
"""Standard deviation of a node from which on `UNCERTAIN_ROPE` is drawn [m]."""
TRUE_ROPE = (0.95, 0.95, 0.95, 0.9)
PREDICTION = (0.2, 0.75, 1.0, 0.8)
PATH = (0.55, 0.5, 0.95, 0.6)
GOAL = (0.25, 0.85, 0.35, 0.9)
OBSTACLE = (0.6, 0.62, 0.68, 0.9)
SUPPORT = (0.62, 0.55, 0.45, 0.6)
REGION = (0.27, 0.67, 0.59, 0.1)


def message(color: tuple[float, ...] | np.ndarray) -> Color:
    """Return the message of a colour."""
    r, g, b, a = (float(value) for value in color)
    return Color(r=r, g=g, b=b, a=a)


def uniform(color: tuple[float, ...], count: int) -> RgbaArray:
    """Return one colour for all points."""
    return np.tile(np.array(color), (count, 1))


def of_sigma(sigma: Float64[np.ndarray, "n"]) -> RgbaArray:
    """Return the colour of each node of a rope by the standard deviation of its position [m]."""
    share = np.clip(sigma / FULL_SIGMA, 0.0, 1.0)[:, None]
    return (1.0 - share) * np.array(ROPE) + share * np.array(UNCERTAIN_ROPE)
