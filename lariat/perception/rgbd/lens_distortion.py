"""Removal of lens distortion from colour and depth images."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import UInt16

from lariat.geometry.cameras import Intrinsics, Picture

OPENCV_MODELS = ("", "plumb_bob", "rational_polynomial")
"""Distortion models whose coefficients are those of OpenCV."""
COEFFICIENT_COUNTS = (4, 5, 8, 12, 14)
"""Numbers of coefficients that OpenCV's models take."""
NEGLIGIBLE_DISTORTION = 0.05
"""Largest displacement of a pixel up to which images are passed on unchanged [pixels]."""


class Undistortion:
    """Undistorts colour and depth images of one calibration; the intrinsics stay the same."""

    def __init__(
        self, intrinsics: Intrinsics, distortion: Sequence[float], model: str = "plumb_bob"
    ) -> None:
        """Prepare the remapping.

        Args:
            intrinsics: Intrinsics of both images.
            distortion: Coefficients of the distortion model, in OpenCV's order.
            model: Distortion model by its name in ROS.

        Raises:
            ValueError: The distortion model is unknown, or has a wrong number of coefficients.
        """
        coefficients = np.array(distortion, float)
        self._maps = None
        if not np.any(coefficients):
            return
        if model not in OPENCV_MODELS:
            raise ValueError(
                f"distortion_model {model!r} is unknown; publish {' or '.join(OPENCV_MODELS[1:])}, "
                "or undistorted images with D = 0"
            )
        if len(coefficients) not in COEFFICIENT_COUNTS or not np.all(np.isfinite(coefficients)):
            raise ValueError(
                f"D must hold 4, 5, 8, 12 or 14 finite coefficients, got {coefficients.tolist()}"
            )
        i = intrinsics
        matrix = np.array([[i.fx, 0.0, i.cx], [0.0, i.fy, i.cy], [0.0, 0.0, 1.0]])
        size = i.width, i.height
        x, y = cv2.initUndistortRectifyMap(
            matrix, coefficients, np.eye(3), matrix, size, cv2.CV_32FC1
        )
        columns, rows = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
        if max(np.max(np.abs(x - columns)), np.max(np.abs(y - rows))) > NEGLIGIBLE_DISTORTION:
            # Fixed-point maps are several times as fast; depth must never be interpolated.
            self._maps = cv2.convertMaps(x, y, cv2.CV_16SC2)
            self._nearest = cv2.convertMaps(x, y, cv2.CV_16SC2, nninterpolation=True)

    def __call__(
        self, color: Picture, depth: UInt16[np.ndarray, "h w"]
    ) -> tuple[Picture, UInt16[np.ndarray, "h w"]]:
        """Return both images without distortion.

        Args:
            color: Red, green, blue, or the brightness.
            depth: Depth image [mm].
        """
        if self._maps is None:
            return color, depth
        return self.color(color), cv2.remap(depth, *self._nearest, cv2.INTER_NEAREST)

    def color(self, color: Picture) -> Picture:
        """Return a colour image, or its brightness, without distortion."""
        return color if self._maps is None else cv2.remap(color, *self._maps, cv2.INTER_LINEAR)
