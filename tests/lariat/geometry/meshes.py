"""Meshes of tests."""

import numpy as np


def box_mesh(low, high) -> np.ndarray:
    """Triangles of a box, outward normals."""
    low, high = np.array(low, float), np.array(high, float)
    corners = np.array(np.meshgrid(*[(0.0, 1.0)] * 3, indexing="ij")).reshape(3, -1).T
    corners = low + corners * (high - low)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))]
    return corners[np.array(faces)]


def prism_mesh(outline, height: float) -> np.ndarray:
    """Triangles of an outline that stands on z = 0, seen from its first corner all round."""
    outline = np.array(outline, float)
    low = np.column_stack([outline, np.zeros(len(outline))])
    high = low + np.array([0.0, 0.0, height])
    found = []
    for k in range(len(outline)):
        j = (k + 1) % len(outline)
        found += [(low[k], low[j], high[j]), (low[k], high[j], high[k])]
    for k in range(1, len(outline) - 1):
        found += [(low[0], low[k + 1], low[k]), (high[0], high[k], high[k + 1])]
    return np.array(found)


def ring_mesh(radius: float, tube: float, around: int = 24, across: int = 8) -> np.ndarray:
    """Triangles of a torus around z."""
    u, v = np.meshgrid(np.arange(around + 1), np.arange(across + 1), indexing="ij")
    # The last row is the first one, exactly.
    u, v = 2.0 * np.pi * (u % around) / around, 2.0 * np.pi * (v % across) / across
    beyond = radius + tube * np.cos(v)
    nodes = np.stack([beyond * np.cos(u), beyond * np.sin(u), tube * np.sin(v)], axis=-1)
    a, b, c, d = nodes[:-1, :-1], nodes[1:, :-1], nodes[1:, 1:], nodes[:-1, 1:]
    first, second = np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)
    return np.concatenate([first.reshape(-1, 3, 3), second.reshape(-1, 3, 3)])
