"""Chains of points: arc length, resampling, distances between chains."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64


def arc_lengths(nodes: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, "n"]:
    """Distance along the chain from its first node to every node [m]."""
    edges = np.linalg.norm(np.diff(nodes, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(edges)])


def length(nodes: Float64[np.ndarray, "n 3"]) -> float:
    """Length of the chain [m]."""
    return float(arc_lengths(nodes)[-1])


def resampled(nodes: Float64[np.ndarray, "n 3"], count: int) -> Float64[np.ndarray, "m 3"]:
    """`count` nodes at equal arc length along the chain."""
    s = arc_lengths(nodes)
    at = np.linspace(0.0, s[-1], count)
    return np.stack([np.interp(at, s, nodes[:, k]) for k in range(3)], axis=1)


def mean_node_distance(a: Float64[np.ndarray, "n 3"], b: Float64[np.ndarray, "n 3"]) -> float:
    """Mean distance of nodes of equal index [m], the paper's error measure (Table 3)."""
    return float(np.mean(np.linalg.norm(a - b, axis=1)))
