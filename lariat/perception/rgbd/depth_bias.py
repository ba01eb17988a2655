"""Bias of the camera's depth, and the noise that neighbouring pixels share, measured on the table.

The table fills most of the image, and its height is known. The difference between its measured and
its expected depth is a bias of the sensor, or an error of the camera's position along its view.
Both displace the rope against its grips by the same amount, and both are corrected. Noise that
neighbouring pixels share, as of a second projector, displaces parts of the rope: no mean over
pixels removes it, so that it adds to the uncertainty.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, UInt16

from lariat.geometry import poses
from lariat.geometry.cameras import Camera
from lariat.geometry.obstacles import Obstacle, scene_distance

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class DepthBiasSettings:
    """Sampling of the table and acceptance of its measurements."""

    pixel_stride: int = 12
    """Stride of the rows and columns that are sampled [pixels]."""
    max_bias: float = 0.012
    """Depth error above which a pixel does not show the table [m]."""
    obstacle_margin: float = 0.02
    """Distance from other obstacles below which a point does not count as table [m]."""
    min_table_share: float = 0.1
    """Share of the sampled pixels that must show the table."""
    max_half_difference: float = 0.004
    """Difference of the bias between halves of the image above which it is not uniform [m]."""
    min_half_share: float = 0.1
    """Share of the table's pixels below which half of an image is not compared."""
    averaged_frames: int = 30
    """Number of measurements in the running mean."""
    update_period: int = 10
    """Period of further measurements once the mean is complete [frames]."""
    ignored_bias: float = 0.0007
    """Bias up to which nothing is corrected [m]."""
    corrected_bias: float = 0.0014
    """Bias above which the correction is complete [m]; from `ignored_bias` on it is partial."""


class DepthBias:
    """Running means of the depth bias and of the shared noise of one camera."""

    def __init__(
        self,
        camera: Camera,
        bodies: Sequence[Obstacle],
        settings: DepthBiasSettings | None = None,
    ) -> None:
        """
        Args:
            camera: Camera at its calibrated pose.
            bodies: Half spaces, of which the first on a pixel's ray is visible, and the obstacles
                that stand on them.
            settings: Sampling and acceptance.
        """
        self._settings = settings or DepthBiasSettings()
        planes = [o for o in bodies if o.shape == "half_space"]
        self._camera, self._standing = camera, [o for o in bodies if o.shape != "half_space"]
        i, stride = camera.intrinsics, self._settings.pixel_stride
        rows, columns = np.mgrid[stride // 2 : i.height : stride, stride // 2 : i.width : stride]
        self._sampled = rows.ravel(), columns.ravel()
        # Beside each sampled pixel the next one, of which the last column has none.
        self._neighbors = rows.ravel(), np.minimum(columns.ravel() + 1, i.width - 1)
        pixels = np.stack([columns.ravel(), rows.ravel()], axis=1).astype(float)
        self._pixels, self._expected = pixels, _plane_depths(camera, planes, pixels)
        beside = np.stack(self._neighbors[::-1], axis=1).astype(float)
        self._expected_neighbors = _plane_depths(camera, planes, beside)
        self._halves = np.stack([pixels[:, 0] < i.width / 2.0, pixels[:, 1] < i.height / 2.0])
        self._mean, self._count, self._frames, self._reported = 0.0, 0, 0, False
        self._shared_variance = 0.0

    def update(self, depth: UInt16[np.ndarray, "h w"]) -> float:
        """Take in a frame and return the bias to subtract from its depths [m].

        Args:
            depth: Depth image [mm], 0 where nothing was measured.
        """
        s = self._settings
        self._frames += 1
        if self._count < s.averaged_frames or self._frames % s.update_period == 0:
            self._measure(depth[self._sampled] / 1e3, depth[self._neighbors] / 1e3)
        span = s.corrected_bias - s.ignored_bias
        share = float(np.clip((abs(self._mean) - s.ignored_bias) / span, 0.0, 1.0))
        self._report(share)
        return share * self._mean

    @property
    def shared_noise(self) -> float:
        """Standard deviation of the noise that neighbouring pixels share [m]; 0 if unknown."""
        return math.sqrt(max(0.0, self._shared_variance))

    def _measure(
        self, measured: Float64[np.ndarray, "k"], neighbors: Float64[np.ndarray, "k"]
    ) -> None:
        s = self._settings
        error = measured - self._expected
        table = (measured > 0.0) & (np.abs(error) < s.max_bias)
        if self._standing and np.any(table):
            points = self._camera.back_project(self._pixels[table], measured[table])
            table[table] = scene_distance(points, self._standing) > s.obstacle_margin
        if np.mean(table) >= s.min_table_share and self._uniform(error, table):
            self._count = min(self._count + 1, s.averaged_frames)
            self._mean += (float(np.median(error[table])) - self._mean) / self._count
            beside = neighbors - self._expected_neighbors
            pairs = table & (neighbors > 0.0) & (np.abs(beside) < s.max_bias)
            # What neighbours do not share is half the variance of their difference.
            shared = np.cov(error[pairs], beside[pairs])[0, 1] if np.any(pairs) else 0.0
            self._shared_variance += (float(shared) - self._shared_variance) / self._count

    def _uniform(self, error: Float64[np.ndarray, "k"], table: np.ndarray) -> bool:
        """Whether opposite halves of the image show the same bias."""
        s = self._settings
        for half in self._halves:
            one, other = error[table & half], error[table & ~half]
            few = min(len(one), len(other)) < s.min_half_share * np.count_nonzero(table)
            if not few and abs(float(np.median(one) - np.median(other))) > s.max_half_difference:
                return False
        return True

    def _report(self, share: float) -> None:
        if (share == 1.0) != self._reported and share in (0.0, 1.0):
            self._reported = share == 1.0
            if self._reported:
                log.warning(
                    "depth of the table is off by %.1f mm and is corrected; run lariat calibrate "
                    "to find the camera's pose",
                    1e3 * self._mean,
                )


def _plane_depths(
    camera: Camera, planes: Sequence[Obstacle], pixels: Float64[np.ndarray, "k 2"]
) -> Float64[np.ndarray, "k"]:
    """Depth of the first plane on each pixel's ray; infinite where there is none [m]."""
    rays, eye = camera.rays(pixels), camera.T_world_camera.position
    depths = np.full(len(pixels), np.inf)
    for plane in planes:
        normal = poses.rotate(np.array(plane.orientation), np.array(plane.normal))
        down = rays @ normal
        above = (eye - np.array(plane.position)) @ normal
        with np.errstate(divide="ignore"):
            depth = np.where(down < -1e-6, -above / down, np.inf)
        depths = np.where(depth > 0.0, np.minimum(depths, depth), depths)
    return depths
