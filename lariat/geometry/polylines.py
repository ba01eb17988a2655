"""Chains of points: arc length, resampling, midpoints, distances between chains."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import poses

ARC_LENGTH_SAMPLES = 8
"""Samples of every edge by which the arc length of a smooth curve is measured [-]."""


def arc_lengths(nodes: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, "n"]:
    """Return the distance along a chain from its first node to every node [m]."""
    edges = nodes[1:] - nodes[:-1]
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(edges, axis=1))])


def length(nodes: Float64[np.ndarray, "n 3"]) -> float:
    """Return the length of a chain [m]."""
    return float(arc_lengths(nodes)[-1])


def ends_of(count: int) -> Bool[np.ndarray, "n"]:
    """Return which of a number of nodes are the first and the last one."""
    ends = np.zeros(count, dtype=bool)
    ends[[0, -1]] = True
    return ends


def within(nodes: Float64[np.ndarray, "n 3"], begin: float, end: float) -> Bool[np.ndarray, "n"]:
    """Return which nodes of a chain lie between two distances along it [m], ends included."""
    s = arc_lengths(nodes)
    margin = 1e-6 * s[-1]
    return (s >= begin - margin) & (s <= end + margin)


def cut(nodes: Float64[np.ndarray, "n 3"], begin: float, end: float) -> Float64[np.ndarray, "m 3"]:
    """Return the stretch of a chain between two distances along it [m], with both its ends."""
    s = arc_lengths(nodes)
    at = np.concatenate([[begin], s[(s > begin) & (s < end)], [end]])
    return np.stack([np.interp(at, s, nodes[:, k]) for k in range(3)], axis=1)


def resample(nodes: Float64[np.ndarray, "n 3"], count: int) -> Float64[np.ndarray, "m 3"]:
    """Return `count` nodes at equal distances of arc length along a chain [m]."""
    s = arc_lengths(nodes)
    at = np.linspace(0.0, s[-1], count)
    return np.stack([np.interp(at, s, nodes[:, k]) for k in range(3)], axis=1)


def resample_smooth(nodes: Float64[np.ndarray, "n 3"], count: int) -> Float64[np.ndarray, "m 3"]:
    """Return `count` nodes at equal distances of arc length along a smooth curve [m].

    The curve goes through the given nodes; its tangents there are those of the parabolas through
    three neighbours. Unlike `resample`, it does not cut the corners of a bent rope: its error falls
    with the third power of the distance between nodes.
    """
    nodes = _distinct(nodes)
    if len(nodes) < 3:
        return resample(nodes, count)
    edges = nodes[1:] - nodes[:-1]
    chords = np.sqrt(np.add.reduce(edges * edges, axis=1))[:, None]
    slopes = edges / chords
    weights = chords[:-1] / (chords[:-1] + chords[1:])
    inner = (1.0 - weights) * slopes[:-1] + weights * slopes[1:]
    first, last = 2.0 * slopes[0] - inner[0], 2.0 * slopes[-1] - inner[-1]
    tangents = np.concatenate([first[None], inner, last[None]])

    s = np.zeros(1 + ARC_LENGTH_SAMPLES * len(chords))
    np.cumsum(_sample_distances(nodes, chords, slopes, tangents), out=s[1:])
    at = np.interp(np.linspace(0.0, s[-1], count), s, np.linspace(0.0, len(chords), len(s)))
    edge = np.minimum(at.astype(int), len(chords) - 1)
    value, rise, fall = _hermite_weights((at - edge)[:, None])
    moved = value * slopes[edge] + rise * tangents[edge] + fall * tangents[edge + 1]
    return nodes[edge] + chords[edge] * moved


def _sample_distances(
    nodes: Float64[np.ndarray, "n 3"],
    chords: Float64[np.ndarray, "n-1 1"],
    slopes: Float64[np.ndarray, "n-1 3"],
    tangents: Float64[np.ndarray, "n 3"],
) -> Float64[np.ndarray, "k"]:
    """Return the distances between successive samples of a smooth curve [m]."""
    # Coordinate by coordinate, with the edges innermost: in a quarter of the time of rows of three.
    corners, along, bends = (np.ascontiguousarray(a.T) for a in (nodes, slopes, tangents))
    value, rise, fall = _SAMPLE_WEIGHTS
    samples = np.empty((3, ARC_LENGTH_SAMPLES + 1, len(chords)))
    samples[:, 0], samples[:, -1] = corners[:, :-1], corners[:, 1:]
    moved = value * along[:, None]
    moved += rise * bends[:, None, :-1]
    moved += fall * bends[:, None, 1:]
    moved *= chords[:, 0]
    np.add(corners[:, None, :-1], moved, out=samples[:, 1:-1])
    x, y, z = samples[:, 1:] - samples[:, :-1]
    return np.sqrt(x * x + y * y + z * z).T.ravel()


def _hermite_weights(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the weights of end value and both slopes of a cubic in 0…1 that begins at zero."""
    return t * t * (3.0 - 2.0 * t), t * (1.0 - t) ** 2, t * t * (t - 1.0)


_SAMPLE_WEIGHTS = _hermite_weights(
    np.linspace(0.0, 1.0, ARC_LENGTH_SAMPLES, endpoint=False)[1:, None]
)
"""Weights at the samples within an edge."""


def end_tangents(
    nodes: Float64[np.ndarray, "n 3"],
) -> tuple[Float64[np.ndarray, "3"], Float64[np.ndarray, "3"]]:
    """Return unit tangents of a smooth curve at its first and its last node.

    They are those of the parabolas through the three nodes at each end.
    """
    nodes = _distinct(nodes)
    if len(nodes) == 2:
        along = (nodes[1] - nodes[0]) / np.linalg.norm(nodes[1] - nodes[0])
        return along, along
    directions = []
    for a, b, c in (nodes[:3], nodes[:-4:-1]):
        first, second = np.linalg.norm(b - a), np.linalg.norm(c - b)
        slopes = (b - a) / first, (c - b) / second
        bend = first / (first + second) * (slopes[1] - slopes[0])
        directions.append((slopes[0] - bend) / np.linalg.norm(slopes[0] - bend))
    return directions[0], -directions[1]


def end_angles(
    nodes: Float64[np.ndarray, "n 3"], orientations: Float64[np.ndarray, "2 4"]
) -> Float64[np.ndarray, "2"]:
    """Return the angles between a chain's tangents at its ends and the z axes of two frames [rad].

    Args:
        nodes: Nodes of the chain [m].
        orientations: Orientations of grips at both ends, z from the first node to the last one.
    """
    directions = poses.rotate(orientations, np.array([0.0, 0.0, 1.0]))
    tangents = np.stack(end_tangents(nodes))
    across = np.linalg.norm(np.cross(tangents, directions), axis=1)
    return np.arctan2(across, np.sum(tangents * directions, axis=1))


def with_midpoints(nodes: Float64[np.ndarray, "*b n 3"]) -> Float64[np.ndarray, "*b m 3"]:
    """Return the nodes of chains, followed by the midpoints of their edges, m = 2 n - 1 [m]."""
    return np.concatenate([nodes, 0.5 * (nodes[..., 1:, :] + nodes[..., :-1, :])], axis=-2)


def mean_node_distance(a: Float64[np.ndarray, "n 3"], b: Float64[np.ndarray, "n 3"]) -> float:
    """Return the mean distance between nodes of equal index [m].

    Error measure of Ying & Yamazaki (2024), Table 3.
    """
    return float(np.mean(np.linalg.norm(a - b, axis=1)))


def point_distances(
    a: Float64[np.ndarray, "k d"], b: Float64[np.ndarray, "n d"]
) -> Float64[np.ndarray, "k n"]:
    """Return the distance of each of k points from each of n others [m]."""
    squares = _squared_distances(a, b)
    return np.sqrt(squares, out=squares)


def least_distances(
    a: Float64[np.ndarray, "k d"], b: Float64[np.ndarray, "n d"]
) -> Float64[np.ndarray, "k"]:
    """Return the distance of each of k points from the nearest of n others [m]."""
    return np.sqrt(np.min(_squared_distances(a, b), axis=1))


def _squared_distances(
    a: Float64[np.ndarray, "k d"], b: Float64[np.ndarray, "n d"]
) -> Float64[np.ndarray, "k n"]:
    """Return the squared distance of each of k points from each of n others [m^2].

    Coordinate by coordinate this takes a quarter of the time of norms of an array of vectors.
    """
    squares = np.subtract.outer(a[:, 0], b[:, 0])
    squares *= squares
    for axis in range(1, a.shape[1]):
        difference = np.subtract.outer(a[:, axis], b[:, axis])
        difference *= difference
        squares += difference
    return squares


def _distinct(nodes: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, "m 3"]:
    """Return nodes without those that repeat their predecessor."""
    moved = np.any(nodes[1:] != nodes[:-1], axis=1)
    return nodes if moved.all() else nodes[np.concatenate([[True], moved])]
