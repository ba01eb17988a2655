"""State estimator of one's own: the last observation, carried along with the grips."""

from __future__ import annotations

from collections import deque

import numpy as np
from jaxtyping import Float64

from lariat.protocols import EstimatorSetup, NodeObservation
from lariat.trajectory import MotionState

Nodes = Float64[np.ndarray, "n 3"]
"""Node positions [m]."""


class Carried:
    """Last observation, carried along with the grips since its exposure."""

    def __init__(self, setup: EstimatorSetup) -> None:
        self.along = np.linspace(0.0, 1.0, setup.rod.node_count)[:, None]

    def reset(self, time: float, grips: MotionState, nodes: Nodes) -> None:
        """Begin at rest with known nodes."""
        self.nodes, self.seen_from = nodes, grips.positions
        self.past = deque([(time, grips.positions)], maxlen=100)

    def estimate(
        self, time: float, grips: MotionState, observation: NodeObservation | None
    ) -> Nodes:
        """Return the nodes at the present time, from an older observation or none."""
        self.past.append((time, grips.positions))
        if observation is not None:
            self.nodes = np.where(observation.observed[:, None], observation.nodes, self.nodes)
            self.seen_from = min(self.past, key=lambda row: abs(row[0] - observation.time))[1]
        left, right = grips.positions - self.seen_from
        return self.nodes + (1.0 - self.along) * left + self.along * right
