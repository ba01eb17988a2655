"""Conversion of packed obstacles to rows for the kernels, and back to objects."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import PACKED_WIDTH, SHAPES, SUPPORT_COLUMN, Obstacle
from lariat.rod.launch.layout import OBSTACLE_WIDTH

HALF_SPACE_BOUNDING_RADIUS = 1e12
"""Bounding radius that stands for that of a half space, which is unbounded [m]."""


def kernel_rows(packed: Float64[np.ndarray, "m 12"]) -> Float64[np.ndarray, "m 17"]:
    """Return packed obstacles with rotation matrix and bounding radius, columns as in `layout`.

    Args:
        packed: Obstacles from `lariat.geometry.pack`.

    Raises:
        ValueError: The rows have the wrong width or are not finite.
    """
    packed = np.asarray(packed, float)
    return _rows(packed.shape, packed.tobytes())


@lru_cache(maxsize=64)
def _rows(shape: tuple[int, ...], content: bytes) -> Float64[np.ndarray, "m 17"]:
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
        match SHAPES[int(source[0])]:
            case "half_space":
                row[16] = HALF_SPACE_BOUNDING_RADIUS
            case "sphere":
                row[16] = source[8]
            case "capsule":
                row[16] = source[8] + source[9]
            case "cylinder":
                row[16] = np.hypot(source[8], source[9])
            case "box":
                row[16] = np.linalg.norm(source[8:11])
    rows.setflags(write=False)
    return rows


def unpack(packed: Float64[np.ndarray, "m 12"]) -> list[Obstacle]:
    """Return the obstacles that `lariat.geometry.pack` packed, without their names."""
    found = []
    for row in np.asarray(packed, float):
        shape = SHAPES[int(row[0])]
        body = Obstacle(shape, tuple(row[1:4]), tuple(row[4:8]), support=bool(row[SUPPORT_COLUMN]))
        match shape:
            case "box":
                body = replace(body, size=tuple(2.0 * row[8:11]))
            case "half_space":
                body = replace(body, normal=tuple(row[8:11]))
            case _:
                body = replace(body, radius=float(row[8]), height=float(2.0 * row[9]))
        found.append(body)
    return found
