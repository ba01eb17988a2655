"""Markerless rope detection of the seed paper (Ying & Yamazaki 2024, Fig. 7), the baseline.

The image is binarised and thinned, the pixels of the skeleton are sorted from the fixed end by the
nearest neighbour in the image and projected into space, and nodes are placed along the points
greedily at a distance of L / (n - 1). The method uses no rope diameter, no grips and no noise
model. Interpretation: the paper does not say by what it sorts. Neighbours in space err far more,
because the noise of the depth is larger than the distance of two pixels of the skeleton.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64, UInt16
from skimage.morphology import skeletonize

from lariat.geometry.cameras import Camera, Picture
from lariat.geometry.poses import Pose
from lariat.perception.centerline.estimate import CenterlineEstimate, RopeDimensions
from lariat.perception.lines.segmentation import brightness, segment_rope

MAX_NEIGHBOUR_DISTANCE = 20.0
"""Distance of the nearest neighbour above which sorting stops [pixels]."""


@dataclass(frozen=True)
class PaperTrackerSettings:
    """Threshold of the binarisation, and the extrapolation and uncertainty that the paper lacks."""

    threshold: int = 128
    """Least brightness of the rope, 1..254."""
    max_missing_nodes: int = 3
    """Number of nodes that may be extrapolated at the far end."""
    sigma: float = 0.006
    """Standard deviation of every node [m]; measured, since the method does not estimate it."""
    extrapolation_factor: float = 4.0
    """Factor on the standard deviation of extrapolated nodes."""


class PaperTracker:
    """Tracks the rope with the paper's method, each frame on its own."""

    def __init__(
        self,
        camera: Camera,
        rope: RopeDimensions,
        fixed_end: Pose,
        settings: PaperTrackerSettings | None = None,
    ) -> None:
        """
        Args:
            camera: Camera at its calibrated pose.
            rope: Length and number of nodes.
            fixed_end: Left end of the rope while its grip is unknown.
            settings: Threshold and uncertainty.
        """
        self.camera = camera
        self._rope, self._fixed_end = rope, fixed_end
        self._settings = settings or PaperTrackerSettings()

    def forget(self) -> None:
        """Do nothing: no frame depends on another."""

    def adopt(
        self, estimate: CenterlineEstimate, left: Pose | None, right: Pose | None, stamp: int
    ) -> None:
        """Do nothing: it sees each frame by itself."""

    def warm_up(self, left: Pose, right: Pose) -> None:
        """Do nothing: nothing is compiled."""

    def track(
        self,
        color: Picture,
        depth: UInt16[np.ndarray, "h w"],
        left: Pose | None,
        right: Pose | None,
        stamp: int,
    ) -> CenterlineEstimate:
        """Estimate the rope in a frame; arguments as in `CameraTracker.track`.

        The skeleton never reaches the tip of the rope, so the last nodes are extrapolated straight.
        """
        s, n = self._settings, self._rope.node_count
        start = (left or self._fixed_end).position
        nodes = paper_nodes(color, depth, self.camera, start, self._rope.length, n, s.threshold)
        if len(nodes) < max(2, n - s.max_missing_nodes):
            return CenterlineEstimate.failed(
                f"the paper's algorithm found {len(nodes)} of {n} nodes"
            )
        step = nodes[-1] - nodes[-2]
        rest = nodes[-1] + np.arange(1, n - len(nodes) + 1)[:, None] * step
        observed = np.arange(n) < len(nodes)
        sigma = np.where(observed, s.sigma, s.extrapolation_factor * s.sigma)
        return CenterlineEstimate(np.concatenate([nodes, rest]), sigma, observed)


def paper_nodes(
    color: Picture,
    depth: UInt16[np.ndarray, "h w"],
    camera: Camera,
    start: Float64[np.ndarray, "3"],
    length: float,
    node_count: int,
    threshold: int = 128,
) -> Float64[np.ndarray, "m 3"]:
    """Return the nodes from the fixed end on, as many as the points reach for [m].

    Args:
        color: Red, green, blue.
        depth: Depth image [mm], 0 where nothing was measured.
        camera: Camera of both images.
        start: Position of the fixed end [m].
        length: Length L of the rope [m].
        node_count: Number of nodes n.
        threshold: Least brightness of the rope, 1..254.
    """
    region = segment_rope(brightness(color), threshold)
    if region is None:
        return np.zeros((0, 3))
    rows, columns = np.nonzero(skeletonize(region.mask.view(bool)))
    rows, columns = rows + region.top, columns + region.left
    z = depth[rows, columns] / 1000.0
    pixels = np.stack([columns, rows], axis=1).astype(float)
    order = _order_by_nearest_neighbour(pixels, camera.project(start)[0])
    order = order[z[order] > 0.0]
    points = camera.back_project(pixels[order], z[order])
    return _place_nodes(points, length / (node_count - 1), node_count)


def _order_by_nearest_neighbour(
    pixels: Float64[np.ndarray, "k 2"], start: Float64[np.ndarray, "2"]
) -> Int64[np.ndarray, "m"]:
    """Return the order in which each pixel is the nearest unused one of its predecessor."""
    unused = np.ones(len(pixels), bool)
    here, order = start, []
    reach = np.inf
    while np.any(unused):
        gaps = np.where(unused, np.sum((pixels - here) ** 2, axis=1), np.inf)
        nearest = int(np.argmin(gaps))
        if gaps[nearest] > reach**2:
            break
        unused[nearest] = False
        order.append(nearest)
        here, reach = pixels[nearest], MAX_NEIGHBOUR_DISTANCE
    return np.array(order, dtype=int)


def _place_nodes(
    points: Float64[np.ndarray, "k 3"], spacing: float, count: int
) -> Float64[np.ndarray, "m 3"]:
    """Nodes along a polyline, each at a given distance from the one before."""
    if not len(points):
        return points
    nodes, k = [points[0]], 0
    while len(nodes) < count:
        here = nodes[-1]
        while k < len(points) and np.linalg.norm(points[k] - here) < spacing:
            k += 1
        if k == len(points):
            break
        inner, edge = points[max(k - 1, 0)] - here, points[k] - points[max(k - 1, 0)]
        # Intersection of the polyline with the sphere around the last node.
        a, b, c = edge @ edge, 2.0 * (inner @ edge), inner @ inner - spacing**2
        t = (-b + np.sqrt(max(b * b - 4.0 * a * c, 0.0))) / (2.0 * a) if a > 0.0 else 0.0
        nodes.append(here + inner + float(np.clip(t, 0.0, 1.0)) * edge)
    return np.array(nodes)
