"""Images of real lenses as a pinhole would have taken them."""

from __future__ import annotations

import cv2
import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from jaxtyping import UInt8, UInt16

MODELS = ("", "plumb_bob", "rational_polynomial")
"""Those whose coefficients are OpenCV's."""
NEGLIGIBLE = 0.05
"""Distortion that moves no pixel further is left alone [pixels]."""


class Undistortion:
    """Straightens colour and depth of one calibration; the pinhole keeps its intrinsics."""

    def __init__(self, calibration: CameraCalibration) -> None:
        """Prepares the maps.

        Raises:
            ValueError: The distortion model is unknown, or has a wrong number of coefficients.
        """
        model, coefficients = calibration.distortion_model, np.array(calibration.D, float)
        self._maps = None
        if not np.any(coefficients):
            return
        if model not in MODELS:
            raise ValueError(
                f"distortion_model {model!r} is unknown; publish {' or '.join(MODELS[1:])}, or "
                "straightened images with D = 0"
            )
        if len(coefficients) not in (4, 5, 8, 12, 14) or not np.all(np.isfinite(coefficients)):
            raise ValueError(f"D = {coefficients.tolist()} are no 4, 5, 8, 12 or 14 coefficients")
        matrix = np.array(calibration.K, float).reshape(3, 3)
        size = calibration.width, calibration.height
        x, y = cv2.initUndistortRectifyMap(
            matrix, coefficients, np.eye(3), matrix, size, cv2.CV_32FC1
        )
        columns, rows = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
        if max(np.max(np.abs(x - columns)), np.max(np.abs(y - rows))) > NEGLIGIBLE:
            # Fixed-point maps are several times as fast; depth must never be mixed.
            self._maps = cv2.convertMaps(x, y, cv2.CV_16SC2)
            self._nearest = cv2.convertMaps(x, y, cv2.CV_16SC2, nninterpolation=True)

    def __call__(
        self, color: UInt8[np.ndarray, "h w 3"], depth: UInt16[np.ndarray, "h w"]
    ) -> tuple[UInt8[np.ndarray, "h w 3"], UInt16[np.ndarray, "h w"]]:
        """Both images, straightened."""
        if self._maps is None:
            return color, depth
        return (
            cv2.remap(color, *self._maps, cv2.INTER_LINEAR),
            cv2.remap(depth, *self._nearest, cv2.INTER_NEAREST),
        )
