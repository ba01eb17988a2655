"""Clearance of a chain of segments that moves, between its given shapes too.

Nodes move in straight lines from one shape to the next. Shapes are inserted where a node moves
further than the chain and the bodies are thick, so that the chain cannot jump over a body.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle, segment_distance, signed_distance

MIN_SWEEP_STEP = 5e-4
"""Motion of a node below which no shapes are inserted, however thin a body is [m]."""


def sweep_step(radius: float, obstacles: Sequence[Obstacle]) -> float:
    """Return how far a node may move from shape to shape without jumping over a body [m].

    Args:
        radius: Radius of the chain [m].
        obstacles: Obstacles of the scene.
    """
    thinnest = min((o.thickness for o in obstacles), default=np.inf)
    return max(min(2.0 * radius, thinnest), MIN_SWEEP_STEP)


def swept_clearance(
    chains: Float64[np.ndarray, "t n 3"], radius: float, obstacles: Sequence[Obstacle]
) -> float:
    """Return the least clearance between a moving chain and all obstacles, negative on overlap [m].

    Args:
        chains: Nodes of the chain in successive shapes [m].
        radius: Radius of the chain [m].
        obstacles: Obstacles of the scene.
    """
    lengths = np.linalg.norm(np.diff(chains, axis=1), axis=2)
    moves = np.linalg.norm(np.diff(chains, axis=0), axis=2)
    moves = np.maximum(moves[:, :-1], moves[:, 1:])
    longest = sweep_step(radius, obstacles)
    least = np.inf
    for obstacle in obstacles:
        at_nodes = signed_distance(chains, obstacle)
        least = min(least, float(np.min(at_nodes)))
        # A distance changes by at most the distance travelled, which rules out most segments.
        bound = 0.5 * (at_nodes[:, :-1] + at_nodes[:, 1:] - lengths)
        time, segment = np.nonzero(bound < least)
        if len(time):
            starts, ends = chains[time, segment], chains[time, segment + 1]
            least = min(least, float(np.min(segment_distance(starts, ends, obstacle))))
        between = 0.5 * (bound[:-1] + bound[1:] - moves)
        time, segment = np.nonzero((between < least) & (moves > longest))
        if len(time):
            least = min(least, _inserted(chains, time, segment, moves, longest, obstacle))
    return least - radius


def _inserted(
    chains: Float64[np.ndarray, "t n 3"],
    time: np.ndarray,
    segment: np.ndarray,
    moves: Float64[np.ndarray, "t-1 n-1"],
    longest: float,
    obstacle: Obstacle,
) -> float:
    """Least distance of segments from an obstacle at inserted instants of their motion [m]."""
    counts = np.ceil(moves[time, segment] / longest).astype(int) - 1
    which = np.repeat(np.arange(len(time)), counts)
    order = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    share = ((order + 1.0) / (counts[which] + 1.0))[:, None]
    t, s = time[which], segment[which]
    starts = (1.0 - share) * chains[t, s] + share * chains[t + 1, s]
    ends = (1.0 - share) * chains[t, s + 1] + share * chains[t + 1, s + 1]
    return float(np.min(segment_distance(starts, ends, obstacle)))
