"""How near the bodies of two ends come to each other: grippers, links and bases of their arms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64


@dataclass(frozen=True)
class Spheres:
    """What covers all that moves with one end, and what stands under it, pose by pose."""

    centres: Float64[np.ndarray, "m k 3"]
    """In the world [m]."""
    radii: Float64[np.ndarray, "k"]
    """[m]"""

    @classmethod
    def joined(cls, parts: Sequence[Spheres]) -> Spheres:
        """Several bodies of one end."""
        return cls(
            np.concatenate([p.centres for p in parts], axis=1),
            np.concatenate([p.radii for p in parts]),
        )


def distances(a: Spheres, b: Spheres) -> Float64[np.ndarray, "m"]:
    """Least distance of the surfaces of two ends, for every pose [m]."""
    if not len(a.radii) or not len(b.radii):
        return np.full(len(a.centres), np.inf)
    apart = np.linalg.norm(a.centres[:, :, None] - b.centres[:, None], axis=-1)
    return np.min(apart - a.radii[:, None] - b.radii, axis=(1, 2))
