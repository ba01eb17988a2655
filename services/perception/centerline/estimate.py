"""What perception knows of the rope, expects and says."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from services.perception.centerline.chain_fit import FitSettings
from services.perception.centerline.segmentation import Color


@dataclass(frozen=True)
class RopeModel:
    """What perception must know of the rope."""

    length: float
    """[m]."""
    radius: float
    """[m]."""
    node_count: int
    """Nodes at equal distance along it."""
    heaviness: float = 0.0
    """Weight per length over bending stiffness [1/m^3]: how what is hidden hangs."""


@dataclass(frozen=True)
class CenterlineSettings:
    """How images are read."""

    threshold: int = 128
    """Least brightness of the rope, 1..254; with a colour, least likeness to it."""
    rope_color: Color | None = None
    """Of a rope that is told by its colour; None: it is brighter than everything else."""
    depth_sigma: float = 0.0015
    """Standard deviation of one depth [m]."""
    depth_quantum: float = 0.001
    """Step of the depth values [m]."""
    grip_sigma: float = 0.0003
    """Deviation of a grip's position as seen by the camera: calibration [m]."""
    fit: FitSettings = FitSettings()


@dataclass(frozen=True)
class Expected:
    """Where the rope is thought to be."""

    positions: Float64[np.ndarray, "n 3"]
    """[m]."""
    sigma: Float64[np.ndarray, "n"]
    """[m]."""


@dataclass(frozen=True)
class Estimate:
    """Where the rope was seen; `lost` says why it was not."""

    positions: Float64[np.ndarray, "n 3"]
    """[m]; no rows when lost."""
    sigma: Float64[np.ndarray, "n"]
    """Standard deviation of each position, all directions together [m]."""
    observed: Bool[np.ndarray, "n"]
    """False where the position is bridged."""
    lost: str = ""
    """Why there are no positions; empty otherwise."""
    misfit: float = 1.0
    """Residuals over their expected size."""
    doubt: float = 0.0
    """0 where image and chain agree; more than `DOUBTFUL` where they contradict each other."""
