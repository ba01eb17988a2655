"""Sag of a rope below the line between its grips, from its rest shapes at several distances."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.rod import EDGE_AXIS, Rod

SHARES = np.array([0.5, 0.7, 0.85, 0.92, 0.95, 0.96, 0.97, 0.98, 0.99])
"""Distances of the grips at which the rope is laid at rest, relative to its length [-]."""


class SagTable:
    """Sag between level grips along the line between them."""

    def __init__(self, rod: Rod) -> None:
        """Lay the rope at rest at several distances of its grips."""
        self._length = rod.properties.length
        along = poses.rotation_between(EDGE_AXIS, np.array([1.0, 0.0, 0.0]))
        self._sags = np.zeros((len(SHARES), rod.node_count))
        for row, share in zip(self._sags, SHARES, strict=True):
            half = np.array([0.5 * share * self._length, 0.0, 0.0])
            row[:] = -rod.rest(Pose(-half, along), Pose(half, along)).state.positions[:, 2]

    def below(
        self, chords: Float64[np.ndarray, "k 3"], fractions: Float64[np.ndarray, "k"]
    ) -> Float64[np.ndarray, "k"]:
        """Return how far the rope lies below the line between its grips [m].

        Args:
            chords: Vectors from the left to the right grip [m].
            fractions: Places along the rope, 0 to 1; none beyond its ends [-].
        """
        far = np.linalg.norm(chords, axis=1)
        level = np.hypot(chords[:, 0], chords[:, 1]) / np.maximum(far, 1e-12)
        row = np.interp(far / self._length, SHARES, np.arange(len(SHARES), dtype=float))
        first = np.minimum(row.astype(int), len(SHARES) - 2)
        column = np.clip(fractions, 0.0, 1.0) * (self._sags.shape[1] - 1)
        before = np.minimum(column.astype(int), self._sags.shape[1] - 2)
        sag = np.zeros(len(chords))
        for i in (0, 1):
            for j in (0, 1):
                weight = np.abs(1 - i - (row - first)) * np.abs(1 - j - (column - before))
                sag += weight * self._sags[first + i, before + j]
        return level * sag
