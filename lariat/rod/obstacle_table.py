"""Conversion of packed obstacles to rows for the kernels, and back to objects."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import (
    FRICTION_COLUMN,
    PACKED_WIDTH,
    SUPPORT_COLUMN,
    Obstacle,
)
from lariat.rod.launch.layout import OBSTACLE_WIDTH
from lariat.shapes import SHAPES, BodyShape, ShapeName

HALF_SPACE_BOUNDING_RADIUS = 1e12
"""Bounding radius that stands for that of a half space, which is unbounded [m]."""


def kernel_rows(packed: Float64[np.ndarray, "m 13"]) -> Float64[np.ndarray, "m 18"]:
    """Return packed obstacles with rotation matrix and bounding radius, columns as in `layout`.

    Args:
        packed: Obstacles from `lariat.geometry.pack`.

    Raises:
        ValueError: The rows have the wrong width or are not finite.
    """
    packed = np.asarray(packed, float)
    return _rows(packed.shape, packed.tobytes())


@lru_cache(maxsize=64)
def _rows(shape: tuple[int, ...], content: bytes) -> Float64[np.ndarray, "m 18"]:
    """Return the rows; cached, since a controller uses the same scene in every period."""
    packed = np.frombuffer(content).reshape(shape)
    if packed.ndim != 2 or shape[1] != PACKED_WIDTH or not np.all(np.isfinite(packed)):
        raise ValueError(
            f"obstacles must be finite rows of {PACKED_WIDTH} numbers, got shape {packed.shape}; "
            "create them with lariat.geometry.pack"
        )
    rows = np.zeros((len(packed), OBSTACLE_WIDTH))
    rows[:, :4] = packed[:, :4]
    for row, source in zip(rows, packed, strict=True):
        row[4:13] = poses.matrix(source[4:8]).ravel()
        row[13:16] = source[8:11]
        radius = _shape(source[0])[1].bounding_radius(source[8:11])
        row[16] = min(float(radius), HALF_SPACE_BOUNDING_RADIUS)
        row[17] = source[FRICTION_COLUMN]
    rows.setflags(write=False)
    return rows


def unpack(packed: Float64[np.ndarray, "m 13"]) -> list[Obstacle]:
    """Return the obstacles that `lariat.geometry.pack` packed, without their names."""
    obstacles = []
    for row in np.asarray(packed, float):
        name, shape = _shape(row[0])
        place = tuple(row[1:4]), tuple(row[4:8])
        support = bool(row[SUPPORT_COLUMN])
        friction = float(row[FRICTION_COLUMN])
        obstacles.append(
            Obstacle(name, *place, support=support, friction=friction, **shape.unpack(row[8:11]))
        )
    return obstacles


def _shape(code: float) -> tuple[ShapeName, BodyShape]:
    """Name and row of the shape with a code."""
    return list(SHAPES.items())[int(code)]
