"""Colours of a rope by its curvature."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64, UInt8

from dashboard import palette

LEAST_RADIUS = 0.04
"""Radius of a bend at and below which a node has the full colour [m]."""


def curvatures(nodes: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, "n"]:
    """Curvature at each node [1/m]: 2 tan(phi / 2) over the mean length of the two edges.

    phi is the angle between them. An end has the curvature of its neighbour; two nodes have none.
    """
    if len(nodes) < 3:
        return np.zeros(len(nodes))
    edges = np.diff(nodes, axis=0)
    lengths = np.maximum(np.linalg.norm(edges, axis=1), 1e-12)
    tangents = edges / lengths[:, None]
    # |t - s| = 2 sin(phi / 2) and |t + s| = 2 cos(phi / 2).
    sines = np.linalg.norm(tangents[1:] - tangents[:-1], axis=1)
    cosines = np.maximum(np.linalg.norm(tangents[1:] + tangents[:-1], axis=1), 1e-12)
    inner = 2.0 * sines / cosines / (0.5 * (lengths[1:] + lengths[:-1]))
    return np.pad(inner, 1, mode="edge")


def bending_colors(nodes: Float64[np.ndarray, "n 3"]) -> UInt8[np.ndarray, "n 3"]:
    """Colour of each node: from that of a straight rope to that of a bent one."""
    weight = np.clip(LEAST_RADIUS * curvatures(nodes), 0.0, 1.0)[:, None]
    colors = (1.0 - weight) * np.array(palette.STRAIGHT) + weight * np.array(palette.BENT)
    return colors.round().astype(np.uint8)
