"""How far a hidden stretch of rope may be from where a fit bridges it."""

from __future__ import annotations

import itertools

import numpy as np
from jaxtyping import Bool, Float64

FOLDS = 0.15
"""Standard deviation of a hidden stretch as a part of what its length allows: loops are rare."""
FOLDED = 3.0
"""How much larger it is where both ends of the stretch meet: a fold may point anywhere."""


def slack(
    nodes: Float64[np.ndarray, "n 3"],
    edge: float,
    seen: Bool[np.ndarray, "n"],
    held: tuple[bool, bool],
) -> Float64[np.ndarray, "n"]:
    """Standard deviation of every node because of what is hidden; 0 where it is seen [m].

    A fit knows one shape of a hidden stretch; the more it is longer than its chord, the more
    others there are, loops among them.

    Args:
        nodes: As fitted [m].
        edge: Between two of them [m].
        seen: Which of them are.
        held: Whether the left and the right end are where a grip says.
    """
    n = len(nodes)
    known = seen.copy()
    known[0] |= held[0]
    known[-1] |= held[1]
    fixed = np.flatnonzero(known)
    sigma = np.zeros(n)
    for a, b in itertools.pairwise(fixed):
        if b - a < 2:
            continue
        span, chord = (b - a) * edge, float(np.linalg.norm(nodes[b] - nodes[a]))
        bulge = 0.5 * np.sqrt(max(span**2 - chord**2, 0.0))
        along = (np.arange(a, b + 1) - a) / (b - a)
        wide = FOLDS * (1.0 + FOLDED * (2.0 * bulge / span) ** 4)
        sigma[a : b + 1] = wide * bulge * 4.0 * along * (1.0 - along)
    if len(fixed):
        # Beyond the last seen node nothing holds the rope.
        sigma[: fixed[0]] = FOLDS * edge * np.arange(fixed[0], 0, -1)
        sigma[fixed[-1] + 1 :] = FOLDS * edge * np.arange(1, n - fixed[-1])
    return sigma
