"""Places of both grips, one after the other: what paths are made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose


@dataclass(frozen=True)
class Grips:
    """Poses of both grips, in k places."""

    positions: Float64[np.ndarray, "k 2 3"]
    """Positions of the grips [m]."""
    orientations: Float64[np.ndarray, "k 2 4"]
    """Orientations of the grips, wxyz."""

    def __len__(self) -> int:
        return len(self.positions)

    def __getitem__(self, index: object) -> Grips:
        return Grips(self.positions[index], self.orientations[index])

    @classmethod
    def of(cls, *pairs: tuple[Pose, Pose]) -> Grips:
        """Return the poses of pairs of grips."""
        return Grips(
            np.array([[g.position for g in pair] for pair in pairs]),
            np.array([[g.orientation for g in pair] for pair in pairs]),
        )

    @classmethod
    def joined(cls, *parts: Grips) -> Grips:
        """Return several places one after the other."""
        return Grips(
            np.concatenate([p.positions for p in parts]),
            np.concatenate([p.orientations for p in parts]),
        )

    def pair(self, index: int) -> tuple[Pose, Pose]:
        """Return the poses of the left and the right grip in one place."""
        left, right = map(Pose, self.positions[index], self.orientations[index])
        return left, right

    def steps(self) -> Float64[np.ndarray, "k-1 2 6"]:
        """Return translation [m] and rotation vector [rad] from each place to the next."""
        turns = poses.rotation_from(self.orientations[:-1], self.orientations[1:])
        return np.concatenate([np.diff(self.positions, axis=0), turns], axis=2)
