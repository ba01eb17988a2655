"""Observation of the rope."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64


@dataclass(frozen=True)
class RopeObservation:
    """Observation of the rope; without nodes where it is lost."""

    stamp: int
    """Time of the image [ns]."""
    nodes: Float64[np.ndarray, "n 3"]
    """Node positions [m]."""
    sigma: Float64[np.ndarray, "n"]
    """Standard deviation of each node's position [m]."""
    observed: Bool[np.ndarray, "n"]
    """Nodes that were seen, not bridged."""
    p_wrong: float = 0.0
    """Probability that the nodes are not those of the held rope [-]."""
