"""Distance between the bodies of two ends, each covered by spheres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64


@dataclass(frozen=True)
class Spheres:
    """k spheres that cover the bodies of one end, at m poses."""

    centres: Float64[np.ndarray, "m k 3"]
    """Centres in the world frame [m]."""
    radii: Float64[np.ndarray, "k"]
    """Radii [m]."""

    @classmethod
    def joined(cls, parts: Sequence[Spheres]) -> Spheres:
        """Return the spheres of several bodies at the same poses as one set."""
        return cls(
            np.concatenate([p.centres for p in parts], axis=1),
            np.concatenate([p.radii for p in parts]),
        )


def sphere_distances(a: Spheres, b: Spheres) -> Float64[np.ndarray, "m"]:
    """Return the least distance between the surfaces of two sets of spheres at each pose [m]."""
    if not len(a.radii) or not len(b.radii):
        return np.full(len(a.centres), np.inf)
    gaps = np.linalg.norm(a.centres[:, :, None] - b.centres[:, None], axis=-1)
    return np.min(gaps - a.radii[:, None] - b.radii, axis=(1, 2))
