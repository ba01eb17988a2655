"""Errors of the depth images of real sensors, beyond the noise of every pixel.

They are those that active stereo and structured light are known for: holes where the surface gives
too little light back or where it glares, near depths that bleed over edges, bands in which a second
projector disturbs the pattern, and a bias that fades while the sensor warms up.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import UInt8, UInt16

INTERFERENCE_SPEED = 5.0
"""Speed at which the bands of interference wander over the image [pixels/frame]."""
SPECKLE_SIZE = 4
"""Size of the speckles in such a band [pixels]."""


@dataclass(frozen=True)
class DepthFaults:
    """Strengths of the errors; each is off at its default."""

    dark_level: int = 0
    """Brightness below which a surface gives too little light back [1/255]."""
    glare_level: int = 256
    """Brightness from which on a surface glares [1/255]."""
    hole_share: float = 0.7
    """Share of the pixels without depth where it is too dark, or where it glares [-]."""
    hole_size: int = 3
    """Size of a hole [pixels]."""
    bleed: int = 0
    """Distance by which the depths of near things bleed over what lies behind [pixels]."""
    interference: float = 0.0
    """Amplitude of the error of depth in a band of interference [m]."""
    interference_period: float = 120.0
    """Distance of two bands [pixels]; a band is a quarter of it wide."""
    warm_up_bias: float = 0.0
    """Bias at the first frame [m]."""
    warm_up_frames: float = 900.0
    """Number of frames in which it fades to 1/e [-]."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.hole_share <= 1.0:
            raise ValueError(f"hole_share is a share in 0..1, got {self.hole_share}")
        for name in ("hole_size", "interference_period", "warm_up_frames"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")
        if self.bleed < 0:
            raise ValueError(f"bleed must not be negative, got {self.bleed}; 0 turns it off")

    def apply(
        self,
        depth: UInt16[np.ndarray, "h w"],
        color: UInt8[np.ndarray, "h w 3"],
        seed: int,
        frame: int,
    ) -> UInt16[np.ndarray, "h w"]:
        """Return a depth image with these errors; it depends on the arguments only.

        Args:
            depth: Depth [mm], 0 where nothing was measured.
            color: Colour image of the same pixels.
            seed: Seed of the errors.
            frame: Number of the frame.
        """
        random = np.random.default_rng((seed, frame))
        if self.bleed:
            nothing = np.uint16(65535)
            filled = np.where(depth > 0, depth, nothing)
            side = 2 * self.bleed + 1
            near = cv2.erode(filled, np.ones((side, side), np.uint8))
            depth = np.where((depth > 0) & (near < nothing), near, depth)
        error = np.full(depth.shape, 1e3 * self.warm_up_bias * np.exp(-frame / self.warm_up_frames))
        if self.interference:
            place = np.arange(len(depth)) + INTERFERENCE_SPEED * frame
            band = place % self.interference_period < 0.25 * self.interference_period
            speckle = random.normal(size=[-(-n // SPECKLE_SIZE) for n in depth.shape])
            waves = cv2.resize(speckle, None, fx=SPECKLE_SIZE, fy=SPECKLE_SIZE)
            error += 1e3 * self.interference * waves[: len(depth), : depth.shape[1]] * band[:, None]
        shifted = np.clip(np.rint(depth + error), 1, 65535).astype(np.uint16)
        depth = np.where(depth > 0, shifted, depth)
        brightness = color.max(axis=2)
        doubtful = (brightness < self.dark_level) | (brightness >= self.glare_level)
        if np.any(doubtful):
            height, width = (-(-n // self.hole_size) for n in depth.shape)
            coarse = (random.random((height, width)) < self.hole_share).astype(np.uint8)
            holes = cv2.resize(coarse, None, fx=self.hole_size, fy=self.hole_size, interpolation=0)
            depth = np.where(doubtful & (holes[: depth.shape[0], : depth.shape[1]] > 0), 0, depth)
        return depth


REAL_SENSOR = DepthFaults(
    dark_level=20, glare_level=250, bleed=1, interference=0.003, warm_up_bias=0.004
)
"""A sensor that is not warm yet, beside another projector, over a glaring rope on a dark table."""
