"""How far the camera's depth is off, measured on the table.

The table fills most of the picture, and where it lies is known: what is measured there, less what
the camera should see from where it is said to stand, is a bias of its depth or a place that is
wrong along its view. Both put the rope beside its grips by as much, and both are taken off.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64, UInt16

from lariat.geometry import poses
from lariat.geometry.cameras import Camera
from lariat.geometry.obstacles import Obstacle, scene_distance

log = logging.getLogger(__name__)

SPARSE = 12
"""Every so many-th row and column is looked at."""
LARGEST = 0.012
"""What is further off is no bias: something lies there [m]."""
BESIDE = 0.02
"""From other obstacles, within which a point says nothing of the table [m]."""
FEWEST = 0.1
"""Part of the pixels looked at that must show the table."""
UNEVEN = 0.004
"""Difference of the bias between halves of the picture from which on it is something else [m]."""
MEMORY, EVERY = 30, 10
"""Looks that are averaged, and frames from one to the next after so many."""
IGNORED, FULL = 0.0007, 0.0014
"""Biases that nothing is made of, and that are corrected in full; between them in part [m]."""


class DepthBias:
    """Averages looks at the table."""

    def __init__(self, camera: Camera, bodies: Sequence[Obstacle]) -> None:
        """
        Args:
            camera: As it is said to stand.
            bodies: Half spaces, of which the first on a ray is what is seen, and what stands on
                them.
        """
        planes = [o for o in bodies if o.shape == "half_space"]
        self._camera, self._standing = camera, [o for o in bodies if o.shape != "half_space"]
        i = camera.intrinsics
        rows, columns = np.mgrid[SPARSE // 2 : i.height : SPARSE, SPARSE // 2 : i.width : SPARSE]
        self._at = rows.ravel(), columns.ravel()
        pixels = np.stack([columns.ravel(), rows.ravel()], axis=1).astype(float)
        self._pixels, self._expected = pixels, _depths(camera, planes, pixels)
        self._halves = np.stack([pixels[:, 0] < i.width / 2.0, pixels[:, 1] < i.height / 2.0])
        self._mean, self._looks, self._frames, self._said = 0.0, 0, 0, False

    def look(self, depth: UInt16[np.ndarray, "h w"]) -> float:
        """What to take off every depth, this frame's included [m].

        Args:
            depth: [mm], 0 where nothing was measured.
        """
        self._frames += 1
        if self._looks < MEMORY or self._frames % EVERY == 0:
            self._add(depth[self._at] / 1e3)
        part = float(np.clip((abs(self._mean) - IGNORED) / (FULL - IGNORED), 0.0, 1.0))
        self._say(part)
        return part * self._mean

    def _add(self, measured: Float64[np.ndarray, "k"]) -> None:
        error = measured - self._expected
        table = (measured > 0.0) & (np.abs(error) < LARGEST)
        if self._standing and np.any(table):
            points = self._camera.back_project(self._pixels[table], measured[table])
            table[table] = scene_distance(points, self._standing) > BESIDE
        if np.mean(table) >= FEWEST and self._even(error, table):
            self._looks = min(self._looks + 1, MEMORY)
            self._mean += (float(np.median(error[table])) - self._mean) / self._looks

    def _even(self, error: Float64[np.ndarray, "k"], table: np.ndarray) -> bool:
        for half in self._halves:
            one, other = error[table & half], error[table & ~half]
            few = min(len(one), len(other)) < 0.1 * np.count_nonzero(table)
            if not few and abs(float(np.median(one) - np.median(other))) > UNEVEN:
                return False
        return True

    def _say(self, part: float) -> None:
        if (part == 1.0) != self._said and part in (0.0, 1.0):
            self._said = part == 1.0
            if self._said:
                log.warning(
                    "the camera sees the table %.1f mm off: taken off its depth; lariat calibrate "
                    "finds where it stands",
                    1e3 * self._mean,
                )


def _depths(
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
