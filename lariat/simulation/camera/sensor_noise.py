"""Noise settings of the simulated camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class SensorNoise:
    """Errors of the depth and colour images."""

    depth_sigma: float = 0.0015
    """Standard deviation of every depth [m]."""
    depth_bias: float = 0.0
    """Offset of every depth [m]."""
    depth_quantum: float = 0.001
    """Step of the depth values [m]."""
    edge_step: float = 0.02
    """Difference of neighbouring depths above which a pixel lies on an edge [m]."""
    edge_mixing: float = 0.5
    """Probability that the depth of a pixel on an edge is a mixture of both sides [-]."""
    edge_dropout: float = 0.5
    """Probability that a pixel on an edge has no depth [-]."""
    color_sigma: float = 2.0
    """Standard deviation of every colour value [1/255]."""
    exposure: float = 1.0
    """Factor on every colour value [-]."""

    def __post_init__(self) -> None:
        for name in ("depth_sigma", "edge_step", "color_sigma", "exposure"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} must not be negative, got {value}; 0 turns it off")
        if not self.depth_quantum > 0.0:
            raise ValueError(
                f"depth_quantum must be positive, got {self.depth_quantum} m; "
                "depth images hold whole millimetres, so 0.001 is the finest"
            )
        for name in ("edge_mixing", "edge_dropout"):
            value = getattr(self, name)
            if not 0.0 <= value <= 1.0:
                raise ValueError(f"{name} is a probability in 0..1, got {value}")


NOISELESS = SensorNoise(
    depth_sigma=0.0, depth_quantum=0.001, edge_mixing=0.0, edge_dropout=0.0, color_sigma=0.0
)
"""No noise but the quantisation of the images."""
