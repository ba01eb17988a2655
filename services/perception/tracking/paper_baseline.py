"""The seed paper's markerless algorithm (Ying & Yamazaki 2024, Fig. 7), the baseline.

The image is binarised and thinned, every pixel of the skeleton is projected into space, the points
are sorted from the fixed end by the nearest neighbour, and nodes are laid along them greedily at a
distance of L / (n - 1). It knows no rope diameter, no grips and no noise.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64, UInt8, UInt16
from skimage.morphology import skeletonize

from lariat.geometry.cameras import Camera
from services.perception.centerline.estimate import Estimate, RopeModel
from services.perception.centerline.segmentation import brightness, rope_region

LARGEST_JUMP = 0.03
"""Sorting stops where the next point is further away [m]."""
MOST_MISSING = 3
"""Nodes that may be made up at the far end."""
SIGMA = 0.006
"""Of every node [m]: it says nothing about its error, so this is what was measured."""


def paper_nodes(
    color: UInt8[np.ndarray, "h w 3"],
    depth: UInt16[np.ndarray, "h w"],
    camera: Camera,
    start: Float64[np.ndarray, "3"],
    length: float,
    node_count: int,
    threshold: int = 128,
) -> Float64[np.ndarray, "m 3"]:
    """The nodes that were found, from the fixed end: as many as the points reach for.

    Args:
        color: Red, green, blue.
        depth: [mm], 0 where nothing was measured.
        camera: That took both.
        start: Of the fixed end [m].
        length: L, of the rope [m].
        node_count: n.
        threshold: Of the binarisation.
    """
    region = rope_region(brightness(color), threshold)
    if region is None:
        return np.zeros((0, 3))
    rows, columns = np.nonzero(skeletonize(region.mask.view(bool)))
    rows, columns = rows + region.top, columns + region.left
    z = depth[rows, columns] / 1000.0
    pixels = np.stack([columns, rows], axis=1).astype(float)[z > 0.0]
    points = camera.back_project(pixels, z[z > 0.0])
    return _laid(_sorted(points, start), length / (node_count - 1), node_count)


def _sorted(
    points: Float64[np.ndarray, "k 3"], start: Float64[np.ndarray, "3"]
) -> Float64[np.ndarray, "m 3"]:
    """The nearest neighbour of the nearest neighbour, and so on."""
    left = np.ones(len(points), bool)
    here, order = np.asarray(start, float), []
    reach = np.inf
    while np.any(left):
        gaps = np.where(left, np.sum((points - here) ** 2, axis=1), np.inf)
        nearest = int(np.argmin(gaps))
        if gaps[nearest] > reach**2:
            break
        left[nearest] = False
        order.append(nearest)
        here, reach = points[nearest], LARGEST_JUMP
    return points[order]


def _laid(
    points: Float64[np.ndarray, "k 3"], spacing: float, count: int
) -> Float64[np.ndarray, "m 3"]:
    """Nodes along a path, each a spacing away from the one before."""
    if not len(points):
        return points
    nodes, k = [points[0]], 0
    while len(nodes) < count:
        here = nodes[-1]
        while k < len(points) and np.linalg.norm(points[k] - here) < spacing:
            k += 1
        if k == len(points):
            break
        inner, way = points[max(k - 1, 0)] - here, points[k] - points[max(k - 1, 0)]
        # Where the sphere of that spacing around the last node cuts the path.
        a, b, c = way @ way, 2.0 * (inner @ way), inner @ inner - spacing**2
        t = (-b + np.sqrt(max(b * b - 4.0 * a * c, 0.0))) / (2.0 * a) if a > 0.0 else 0.0
        nodes.append(here + inner + float(np.clip(t, 0.0, 1.0)) * way)
    return np.array(nodes)


def paper_estimate(
    color: UInt8[np.ndarray, "h w 3"],
    depth: UInt16[np.ndarray, "h w"],
    camera: Camera,
    start: Float64[np.ndarray, "3"],
    rope: RopeModel,
    threshold: int = 128,
) -> Estimate:
    """All nodes of the rope; the last ones, which a thinned mask never reaches, go straight on.

    Arguments as of `paper_nodes`.
    """
    n = rope.node_count
    found = paper_nodes(color, depth, camera, start, rope.length, n, threshold)
    if len(found) < max(2, n - MOST_MISSING):
        reason = f"the paper's algorithm found {len(found)} of {n} nodes"
        return Estimate(np.zeros((0, 3)), np.zeros(0), np.zeros(0, bool), reason)
    step = found[-1] - found[-2]
    rest = found[-1] + np.arange(1, n - len(found) + 1)[:, None] * step
    observed = np.arange(n) < len(found)
    return Estimate(np.concatenate([found, rest]), np.where(observed, SIGMA, 4.0 * SIGMA), observed)
