"""Uncertainty of the hidden parts of a rope."""

from __future__ import annotations

import itertools

import numpy as np
from jaxtyping import Bool, Float64

SIGMA_OVER_BULGE = 0.15
"""Standard deviation of a hidden stretch, relative to the bulge that its length allows; small,
since loops are rare."""
FOLD_FACTOR = 3.0
"""Relative increase of that ratio where both ends of the stretch coincide: the direction of a fold
is unknown."""


def occlusion_uncertainty(
    nodes: Float64[np.ndarray, "n 3"],
    edge: float,
    observed: Bool[np.ndarray, "n"],
    gripped: tuple[bool, bool],
) -> Float64[np.ndarray, "n"]:
    """Return the standard deviation of every node due to occlusion; 0 where it is observed [m].

    The fit knows one shape of a hidden stretch. The more its length exceeds its chord, the more
    other shapes are possible, loops among them. A stretch of length l and chord c bulges by
    sqrt(l^2 - c^2) / 2; the standard deviation is a parabola over the stretch, proportional to it.

    Args:
        nodes: Fitted nodes [m].
        edge: Distance between two of them along the rope [m].
        observed: Whether each node is observed.
        gripped: Whether a grip holds the left and the right end.
    """
    n = len(nodes)
    located = observed.copy()
    located[0] |= gripped[0]
    located[-1] |= gripped[1]
    fixed = np.flatnonzero(located)
    sigma = np.zeros(n)
    for a, b in itertools.pairwise(fixed):
        if b - a < 2:
            continue
        span, chord = (b - a) * edge, float(np.linalg.norm(nodes[b] - nodes[a]))
        bulge = 0.5 * np.sqrt(max(span**2 - chord**2, 0.0))
        along = (np.arange(a, b + 1) - a) / (b - a)
        ratio = SIGMA_OVER_BULGE * (1.0 + FOLD_FACTOR * (2.0 * bulge / span) ** 4)
        sigma[a : b + 1] = ratio * bulge * 4.0 * along * (1.0 - along)
    if len(fixed):
        # Nothing holds the rope beyond the last observed node.
        sigma[: fixed[0]] = SIGMA_OVER_BULGE * edge * np.arange(fixed[0], 0, -1)
        sigma[fixed[-1] + 1 :] = SIGMA_OVER_BULGE * edge * np.arange(1, n - fixed[-1])
    return sigma
