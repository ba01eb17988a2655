"""Open-loop predictions of a measured motion, and how far they are off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.rod.identification.motion import Motion
from lariat.rod.identification.rod_twin import Replica
from lariat.rod.properties import RodProperties


@dataclass(frozen=True)
class Prediction:
    """A roll-out of every sequence from two measured frames on, driven by the held vertices."""

    motion: Motion
    """What was measured."""
    vertices: Float64[np.ndarray, "S T V 3"]
    """Predicted; measured up to the frame that the roll-out starts from, and where held [m]."""
    first: int
    """The first frame that is predicted."""

    @property
    def errors(self) -> Float64[np.ndarray, "S F"]:
        """Mean absolute error of a coordinate in each frame, held vertices counted [m]."""
        measured = self.motion.vertices[:, self.first :]
        return np.mean(np.abs(self.vertices[:, self.first :] - measured), axis=(2, 3))

    @property
    def scores(self) -> Float64[np.ndarray, "S"]:
        """Of each sequence [m]: the errors' mean, in which the two frames of the start count too.

        The measure of Chen et al., DEFORM (CoRL 2024).
        """
        errors = self.errors
        return np.sum(errors, axis=1) / (errors.shape[1] + 2)


def predict(
    motion: Motion, properties: RodProperties, length_scale: float, start: int = 1
) -> Prediction:
    """Rolls a rod out over the rest of every sequence.

    Args:
        properties: Of the rope, whose length is not used.
        length_scale: Length of the rope between the grips against what the vertices' distances say.
        start: The second of the two frames that give the initial state.
    """
    replica = Replica(motion)
    frames = motion.vertices.shape[1]
    if not 1 <= start < frames - 1:
        raise ValueError(
            f"start must lie between 1 and {frames - 2} in a motion of {frames} frames, got {start}"
        )
    windows = replica.windows(frames - 1 - start, first=start)
    rod = replica.of_length(properties, length_scale)
    whole = motion.vertices.copy()
    whole[:, start + 1 :] = replica.restored(replica.predicted(rod, windows), windows)
    return Prediction(motion, whole, start + 1)
