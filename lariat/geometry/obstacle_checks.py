"""Checks of obstacles from files, messages and user input."""

from __future__ import annotations

import math

import numpy as np

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from lariat.shapes import SHAPES

MAX_OBSTACLES = 256
"""Largest number of obstacles of a scene; their distances must fit a tick of the gateway."""
MAX_COORDINATE = 20.0
"""Largest absolute coordinate of an obstacle's position [m]."""
MAX_SIZE = 20.0
"""Largest radius, height or edge of an obstacle [m]."""
MIN_VECTOR_LENGTH = 1e-6
"""Length below which a quaternion or a normal is rejected as zero [-]."""
UNIT_QUATERNION_TOLERANCE = 1e-3
"""Largest accepted deviation of a quaternion's norm from one [-]."""


def check_obstacle(o: Obstacle) -> None:
    """Check that an obstacle has a name, a known shape, and finite numbers of a sensible size.

    Raises:
        ValueError: The obstacle is invalid; the text names it, the value and the accepted range.
    """
    if not o.name:
        raise ValueError("an obstacle needs a name; give one")
    if o.shape not in SHAPES:
        raise ValueError(f"{o.name!r} has shape {o.shape!r}; use one of {', '.join(SHAPES)}")
    numbers = (*o.position, *o.orientation, *o.size, *o.normal, o.radius, o.height)
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"{o.name!r} holds a number that is not finite")
    if max(map(abs, o.position)) > MAX_COORDINATE:
        raise ValueError(
            f"{o.name!r} is at {list(o.position)} m, more than {MAX_COORDINATE} m away; "
            "positions are in metres"
        )
    for key in SHAPES[o.shape].fields:
        value = getattr(o, key)
        sizes = value if isinstance(value, tuple) else (value,)
        if min(sizes) <= 0.0 or max(sizes) > MAX_SIZE:
            raise ValueError(
                f"{o.name!r} has {key} = {value}; a {o.shape} takes 0 < {key} <= {MAX_SIZE} m"
            )
    for key in ("orientation", "normal"):
        if np.linalg.norm(getattr(o, key)) < MIN_VECTOR_LENGTH:
            raise ValueError(f"{o.name!r} has {key} = {getattr(o, key)}; it must not be zero")
    if abs(np.linalg.norm(o.orientation) - 1.0) > UNIT_QUATERNION_TOLERANCE:
        unit = poses.normalized(np.array(o.orientation)).round(4).tolist()
        raise ValueError(
            f"{o.name!r} has orientation {o.orientation}, not a unit quaternion; try {unit}"
        )
