"""Colours of a perceived rope by the certainty of its nodes."""

from __future__ import annotations

import numpy as np
from jaxtyping import UInt8

from dashboard import palette
from shared.messages import NodeChain

UNCERTAIN_SIGMA = 0.01
"""Standard deviation above which a node has the full warning colour [m]."""


def certainty_colors(message: NodeChain) -> UInt8[np.ndarray, "n 3"]:
    """Colour of each node: from rope to warning colour with its sigma, grey if unobserved."""
    count = len(message.positions) // 3
    sigma = np.array(message.sigma) if len(message.sigma) == count else np.zeros(count)
    weight = np.clip(sigma / UNCERTAIN_SIGMA, 0.0, 1.0)[:, None]
    colors = (1.0 - weight) * np.array(palette.ROPE) + weight * np.array(palette.UNCERTAIN)
    if len(message.observed) == count:
        colors[~np.array(message.observed)] = palette.UNOBSERVED
    return colors.round().astype(np.uint8)
