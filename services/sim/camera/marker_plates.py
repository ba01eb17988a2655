"""Square markers printed on flat plates."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from lariat.geometry.markers import BORDER, CELLS, DICTIONARY
from lariat.geometry.poses import Pose

BLACK, WHITE = 15, 235
"""Grey values of ink and paper."""


@dataclass(frozen=True)
class Plate:
    """A marker and the white border around it."""

    pose: Pose
    """Of its centre: x to the right along its upper edge, y up, z out of its face."""
    side: float
    """Of the black square [m]."""
    identity: int
    """Of the marker."""

    @property
    def packed(self) -> Float64[np.ndarray, "10"]:
        """As `kernels_plates` takes it."""
        x, y = self.pose.apply(np.eye(3)[:2]) - self.pose.position
        half = 0.5 * self.side * (CELLS + 2 * BORDER) / CELLS
        return np.array([*self.pose.position, *x, *y, half])

    @property
    def pattern(self) -> UInt8[np.ndarray, "c c"]:
        """Grey values of its cells, the white border among them."""
        patterns = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, DICTIONARY))
        tag = cv2.aruco.generateImageMarker(patterns, self.identity, CELLS)
        return np.pad(
            np.where(tag > 127, WHITE, BLACK).astype(np.uint8), BORDER, constant_values=WHITE
        )
