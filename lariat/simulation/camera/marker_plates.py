"""Flat plates with a printed square marker."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from lariat.geometry.markers import MARKER_CELLS, MARKER_DICTIONARY, PLATE_MARGIN_CELLS
from lariat.geometry.poses import Pose

BLACK_GREY, WHITE_GREY = 15, 235
"""Grey values of black and white cells [1/255]."""


@dataclass(frozen=True)
class MarkerPlate:
    """Marker with the white border around it."""

    pose: Pose
    """Pose of the centre: x to the right along the upper edge, y up, z out of the face."""
    side: float
    """Side of the black square [m]."""
    identity: int
    """Identity of the marker in the dictionary."""

    @property
    def packed(self) -> Float64[np.ndarray, "10"]:
        """Centre, x axis, y axis and half the side, as `kernels.plates` takes them [m]."""
        x, y = self.pose.apply(np.eye(3)[:2]) - self.pose.position
        half = 0.5 * self.side * (MARKER_CELLS + 2 * PLATE_MARGIN_CELLS) / MARKER_CELLS
        return np.array([*self.pose.position, *x, *y, half])


@functools.cache
def pattern(identity: int) -> UInt8[np.ndarray, "c c"]:
    """Return the grey values of a marker's cells, border included.

    The first row is at +y, the first column at -x.

    Args:
        identity: Identity of the marker in the dictionary.
    """
    patterns = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, MARKER_DICTIONARY))
    tag = cv2.aruco.generateImageMarker(patterns, identity, MARKER_CELLS)
    return np.pad(
        np.where(tag > 127, WHITE_GREY, BLACK_GREY).astype(np.uint8),
        PLATE_MARGIN_CELLS,
        constant_values=WHITE_GREY,
    )
