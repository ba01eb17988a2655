"""Distance between the bodies of two ends, each covered by spheres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses


@dataclass(frozen=True)
class Spheres:
    """k spheres that cover the bodies of one end, at m poses."""

    centres: Float64[np.ndarray, "m k 3"]
    """Centres in the world frame [m]."""
    radii: Float64[np.ndarray, "k"]
    """Radii [m]."""

    @classmethod
    def of_gripper(
        cls,
        cover: tuple[Float64[np.ndarray, "k 3"], float],
        positions: Float64[np.ndarray, "m 3"],
        orientations: Float64[np.ndarray, "m 4"],
    ) -> Spheres:
        """Return the spheres that cover a gripper at m poses of its grip.

        Args:
            cover: Centres in the frame of the grip, and radius [m] (`GripperBody.spheres`).
            positions: Positions of the grip [m].
            orientations: Its orientations, wxyz.
        """
        centres, radius = cover
        points = positions[:, None] + poses.rotate(orientations[:, None], centres[None])
        return cls(points, np.full(len(centres), radius))

    def repeated(self, count: int) -> Spheres:
        """Return spheres of one pose as those of several."""
        return Spheres(np.repeat(self.centres, count, axis=0), self.radii)

    @classmethod
    def joined(cls, parts: Sequence[Spheres]) -> Spheres:
        """Return the spheres of several bodies at the same poses as one set."""
        if len(parts) == 1:
            return parts[0]
        return cls(
            np.concatenate([p.centres for p in parts], axis=1),
            np.concatenate([p.radii for p in parts]),
        )


def sphere_distances(a: Spheres, b: Spheres) -> Float64[np.ndarray, "m"]:
    """Return the least distance between the surfaces of two sets of spheres at each pose [m]."""
    if not len(a.radii) or not len(b.radii):
        return np.full(len(a.centres), np.inf)
    gaps = distances(a.centres, b.centres) - a.radii[:, None] - b.radii
    return np.min(gaps, axis=(1, 2))


def distances(
    a: Float64[np.ndarray, "m k 3"], b: Float64[np.ndarray, "*m l 3"]
) -> Float64[np.ndarray, "m k l"]:
    """Return the distances between all points of two sets at each of m poses [m].

    One axis after the other, which takes a third of the time of the norms of the differences.

    Args:
        a: Points at m poses [m].
        b: Points at the same poses, or at rest [m].
    """
    offset = a[..., :, None, 0] - b[..., None, :, 0]
    squares = offset * offset
    for axis in (1, 2):
        offset = a[..., :, None, axis] - b[..., None, :, axis]
        squares += offset * offset
    return np.sqrt(squares)
