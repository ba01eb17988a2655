"""Open-loop predictions of a measured motion, and their errors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64

from lariat.identification.motion import Motion
from lariat.identification.rod_twin import RodTwin
from lariat.rod.properties import RodProperties


@dataclass(frozen=True)
class Prediction:
    """Roll-outs from two measured frames of each sequence, driven by the held vertices.

    Measured grips take the direction of the rope from the free vertices next to them too.
    """

    motion: Motion
    """Measured motion."""
    vertices: Float64[np.ndarray, "S T V 3"]
    """Predicted vertices; measured ones up to the first frame, and where held [m]."""
    first: int
    """First frame that is predicted."""

    @property
    def errors(self) -> Float64[np.ndarray, "S F"]:
        """Mean absolute error of a coordinate in each frame, held vertices included [m]."""
        measured = self.motion.vertices[:, self.first :]
        return np.mean(np.abs(self.vertices[:, self.first :] - measured), axis=(2, 3))

    @property
    def scores(self) -> Float64[np.ndarray, "S"]:
        """Mean error of each sequence, in which the two initial frames count as exact [m].

        Error measure of Chen et al., "DEFORM" (CoRL 2024).
        """
        errors = self.errors
        return np.sum(errors, axis=1) / (errors.shape[1] + 2)


def predict(
    motion: Motion, properties: RodProperties, length_scale: float, start: int = 1
) -> Prediction:
    """Roll a rod out over the rest of every sequence.

    Args:
        motion: Measured motion.
        properties: Material of the rope, whose length is not used.
        length_scale: Ratio of the rope's length to the one estimated from the vertices [-].
        start: Second of the two frames that give the initial state.

    Raises:
        ValueError: `start` leaves no frame to predict.
    """
    # Of the free vertices, nothing after the first two frames may be known.
    causal = np.where(motion.free[:, None], motion.vertices, motion.smoothed().vertices)
    twin = RodTwin(motion, replace(motion, vertices=causal))
    frames = motion.vertices.shape[1]
    if not 1 <= start < frames - 1:
        raise ValueError(
            f"start must lie between 1 and {frames - 2} in a motion of {frames} frames, got {start}"
        )
    windows = twin.windows(frames - 1 - start, first=start)
    rod = twin.of_length(properties, length_scale)
    whole = motion.vertices.copy()
    whole[:, start + 1 :] = twin.all_vertices(twin.predict(rod, windows), windows)
    return Prediction(motion, whole, start + 1)
