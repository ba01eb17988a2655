"""Input and output types of the centreline estimation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

MAX_INCONSISTENCY = 0.3
"""Inconsistency [-] above which an estimate contradicts its image: no node counts as observed, all
standard deviations are large, and the estimate is not used as the next frame's prior."""

REACH_SIGMAS, REACH_MARGIN = 3.0, 0.008
"""Distance from an expected shape above which something is not the rope: standard deviations [-]
and margin [m]."""
VAGUE_SIGMA = 0.01
"""Largest standard deviation of an expected shape above which the rod at rest tells more [m]."""


@dataclass(frozen=True)
class RopeDimensions:
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

    @property
    def reach(self) -> Float64[np.ndarray, "n"]:
        """Distance from each position within which the rope is expected [m]."""
        return REACH_SIGMAS * self.sigma + REACH_MARGIN

    @property
    def vague(self) -> bool:
        """Whether it allows other ropes to be taken for this one."""
        return float(np.max(self.sigma)) > VAGUE_SIGMA


@dataclass(frozen=True)
class ChainLength:
    """Length of the rope between its grips, as far as it is known from earlier frames."""

    ratio: float = 1.0
    """Length, relative to the given one [-]."""
    measure: bool = False
    """Whether to measure it in this frame, if the rope is seen whole."""


@dataclass(frozen=True)
class OtherLine:
    """Rope that is not the held one."""

    pixels: Float64[np.ndarray, "k 2"]
    """Columns and rows of its axis, in order, bridged where it was not seen."""
    points: Float64[np.ndarray, "k 3"]
    """Points along its axis [m]."""


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
    inconsistency: float = 0.0
    """Inconsistency between image and chain [-]: 0 for none, above `MAX_INCONSISTENCY` for a wrong
    one."""
    p_wrong: float = 0.0
    """Probability that some visible node lies off the rope by more than a centimetre [-]."""
    length_ratio: float | None = None
    """Length of the rope in the image, relative to the given one [-]; None if not measured."""
    rivals: float = 0.0
    """Length of what looks like the rope and may take the place of a seen part, relative to the
    rope's length [-]."""
    others: tuple[OtherLine, ...] = ()
    """Other ropes of its colour in the image."""
    bias: float = 0.0
    """Bias that was subtracted from every depth of the image [m]."""

    @staticmethod
    def failed(reason: str) -> CenterlineEstimate:
        """Return the estimate of a frame in which the rope is lost."""
        return CenterlineEstimate(np.zeros((0, 3)), np.zeros(0), np.zeros(0, bool), reason)
