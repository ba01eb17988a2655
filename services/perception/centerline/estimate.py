"""Input and output types of the centreline estimation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

MAX_DOUBT = 0.3
"""Doubt [-] above which an estimate contradicts its image: no node counts as observed, all standard
deviations are large, and the estimate is not used as the next frame's prior."""


@dataclass(frozen=True)
class RopeModel:
    """Properties of the rope that perception needs."""

    length: float
    """Length at rest [m]."""
    radius: float
    """Radius of the cross-section [m]."""
    node_count: int
    """Number of nodes, evenly spaced along the rope."""
    weight_over_stiffness: float = 0.0
    """Weight per length over bending stiffness [1/m^3]; determines how hidden parts sag."""


@dataclass(frozen=True)
class ShapePrior:
    """Expected shape of the rope."""

    positions: Float64[np.ndarray, "n 3"]
    """Expected node positions [m]."""
    sigma: Float64[np.ndarray, "n"]
    """Standard deviation of each position [m]."""


@dataclass(frozen=True)
class CenterlineEstimate:
    """Node chain seen in one frame."""

    positions: Float64[np.ndarray, "n 3"]
    """Node positions [m]; no rows when the rope is lost."""
    sigma: Float64[np.ndarray, "n"]
    """Standard deviation of each position, all directions together [m]."""
    observed: Bool[np.ndarray, "n"]
    """False where the position is interpolated over a hidden part."""
    lost: str = ""
    """Reason why there are no positions; empty otherwise."""
    misfit: float = 1.0
    """Root mean square of the residuals over their standard deviations [-]."""
    doubt: float = 0.0
    """Contradiction between image and chain [-]: 0 for none, above `MAX_DOUBT` for a wrong one."""

    @staticmethod
    def failed(reason: str) -> CenterlineEstimate:
        """Return the estimate of a frame in which the rope is lost."""
        return CenterlineEstimate(np.zeros((0, 3)), np.zeros(0), np.zeros(0, bool), reason)
