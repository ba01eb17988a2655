"""Colours and beads of a perceived rope by the certainty of its nodes."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64, UInt8

from dashboard import palette
from shared.messages import NodeChain

UNCERTAIN_SIGMA = 0.01
"""Standard deviation above which a node has the full warning colour [m]."""

BEAD_SIGMAS = 2.0
"""Radius of a bead in standard deviations [-]."""
MAX_BEAD_RADIUS = 0.03
"""Largest radius of a bead [m]; a rope that was never seen would fill the scene."""


def bead_radii(message: NodeChain, radius: float) -> Float64[np.ndarray, "n"]:
    """Radius of the ball drawn at each node [m]: two standard deviations, at least the rope's."""
    count = len(message.positions) // 3
    sigma = np.array(message.sigma) if len(message.sigma) == count else np.zeros(count)
    return np.clip(BEAD_SIGMAS * sigma, radius, max(radius, MAX_BEAD_RADIUS))


def certainty_colors(message: NodeChain) -> UInt8[np.ndarray, "n 3"]:
    """Colour of each node: from rope to warning colour with its sigma, grey if unobserved."""
    count = len(message.positions) // 3
    sigma = np.array(message.sigma) if len(message.sigma) == count else np.zeros(count)
    weight = np.clip(sigma / UNCERTAIN_SIGMA, 0.0, 1.0)[:, None]
    colors = (1.0 - weight) * np.array(palette.ROPE) + weight * np.array(palette.UNCERTAIN)
    if len(message.observed) == count:
        colors[~np.array(message.observed)] = palette.UNOBSERVED
    return colors.round().astype(np.uint8)
