"""Chains of points: arc length, resampling, midpoints, distances between chains."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64


def arc_lengths(nodes: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, "n"]:
    """Return the distance along a chain from its first node to every node [m]."""
    edges = np.linalg.norm(np.diff(nodes, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(edges)])


def length(nodes: Float64[np.ndarray, "n 3"]) -> float:
    """Return the length of a chain [m]."""
    return float(arc_lengths(nodes)[-1])


def resample(nodes: Float64[np.ndarray, "n 3"], count: int) -> Float64[np.ndarray, "m 3"]:
    """Return `count` nodes at equal distances of arc length along a chain [m]."""
    s = arc_lengths(nodes)
    at = np.linspace(0.0, s[-1], count)
    return np.stack([np.interp(at, s, nodes[:, k]) for k in range(3)], axis=1)


def with_midpoints(nodes: Float64[np.ndarray, "*b n 3"]) -> Float64[np.ndarray, "*b m 3"]:
    """Return the nodes of chains, followed by the midpoints of their edges, m = 2 n - 1 [m]."""
    return np.concatenate([nodes, 0.5 * (nodes[..., 1:, :] + nodes[..., :-1, :])], axis=-2)


def mean_node_distance(a: Float64[np.ndarray, "n 3"], b: Float64[np.ndarray, "n 3"]) -> float:
    """Return the mean distance between nodes of equal index [m].

    Error measure of Ying & Yamazaki (2024), Table 3.
    """
    return float(np.mean(np.linalg.norm(a - b, axis=1)))


def end_tangents(
    nodes: Float64[np.ndarray, "n 3"],
) -> tuple[Float64[np.ndarray, "3"], Float64[np.ndarray, "3"]]:
    """Return unit tangents at the first and the last node of an evenly spaced curve.

    They are those of the parabolas through the three nodes nearest to each end.

    Args:
        nodes: At least three points along the curve [m].
    """
    first = -3.0 * nodes[0] + 4.0 * nodes[1] - nodes[2]
    last = 3.0 * nodes[-1] - 4.0 * nodes[-2] + nodes[-3]
    return first / np.linalg.norm(first), last / np.linalg.norm(last)
