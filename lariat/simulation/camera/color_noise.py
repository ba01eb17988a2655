"""Noise of the colour images."""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import UInt8

FRAME_STRIDE = 7919
"""Offset of the noise between two frames in its table, a prime [elements]."""
MARGIN = 999_983
"""Length by which the table exceeds a frame [elements]."""


class ColorNoise:
    """Noise of every colour value; that of a frame is a window of a table.

    Drawing it anew would cost 10 ms a frame.
    """

    def __init__(self, sigma: float, size: int, random: np.random.Generator) -> None:
        """Draw the table.

        Args:
            sigma: Standard deviation of every colour value [1/255].
            size: Number of colour values of a frame.
            random: Source of the table.
        """
        noise = np.rint(random.standard_normal(size + MARGIN) * sigma)
        # By how much values are raised and lowered: sums of bytes saturate and are quick.
        self._raised = np.clip(noise, 0.0, 255.0).astype(np.uint8)
        self._lowered = np.clip(-noise, 0.0, 255.0).astype(np.uint8)

    def added(self, color: UInt8[np.ndarray, "h w3"], frame: int) -> UInt8[np.ndarray, "h w3"]:
        """Return colours with the noise of a frame, in a new array.

        Args:
            color: Colour values of the pixels, one after the other [1/255].
            frame: Number of the frame.
        """
        start = frame * FRAME_STRIDE % MARGIN
        window = slice(start, start + color.size)
        noisy = cv2.add(color, self._raised[window].reshape(color.shape))
        return cv2.subtract(noisy, self._lowered[window].reshape(color.shape), dst=noisy)
