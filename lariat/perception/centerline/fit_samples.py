"""Measurements for the chain fit: rays and ranges of a ridge, anchors at grips and priors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64, Int64

from lariat.geometry import polylines, poses
from lariat.geometry.cameras import Camera
from lariat.geometry.poses import Pose
from lariat.perception.centerline.estimate import OtherLine, RopeDimensions, ShapePrior
from lariat.perception.centerline.observation import Observation
from lariat.perception.centerline.settings import CenterlineSettings
from lariat.perception.lines.ridge import sample_depth

FLANK_MARGIN = 1.5
"""Distance from the rope's flanks within which a pixel may show the background [pixels]."""
MAX_FLANK_OFFSET = 3.0
"""Largest distance of a sampled pixel from the axis [pixels]."""

OTHER_MARGIN_WIDTHS = 1.3
"""Distance from the axis of another rope within which the image may show that one [rope widths]."""

OTHER_MARGIN = 0.008
"""Distance between the surfaces of two ropes up to which a range may be of either [m]."""
MERGED_WIDTHS = 1.3
"""Width of a region, in addition to two pixels, above which it shows two ropes [rope widths]."""

Samples = tuple[Float64[np.ndarray, "m 6"], Int64[np.ndarray, "m"]]
"""Samples, columns as in `kernels.fit.fit`, and the ridge point of each."""


class SegmentSamples:
    """Samples of one observation's segments, computed once for all hypotheses."""

    def __init__(
        self,
        observation: Observation,
        camera: Camera,
        rope: RopeDimensions,
        settings: CenterlineSettings,
    ) -> None:
        self.observation, self._camera = observation, camera
        self._rope, self._settings = rope, settings
        self._cache: dict[int, Samples] = {}
        self._known: Sequence[OtherLine] = ()
        self._without_known: dict[int, Samples] = {}

    def of(self, segment: int) -> Samples:
        """Return the samples of a segment."""
        if segment not in self._cache:
            self._cache[segment] = self._compute(segment)
        return self._cache[segment]

    def without(self, segment: int, others: Sequence[OtherLine]) -> Samples:
        """Return the samples of a segment that cannot be other ropes'; columns as in `of`.

        Rays are left out where the image shows another rope, or two ropes as one region; ranges,
        where they lead to another rope. Those of the last `others` are kept: hypotheses have them
        in common.

        Args:
            segment: Index of the segment.
            others: Lines of other ropes.
        """
        if others is not self._known:
            self._known, self._without_known = others, {}
        if segment not in self._without_known:
            self._without_known[segment] = self._compute_without(segment, others)
        return self._without_known[segment]

    def _compute_without(self, segment: int, others: Sequence[OtherLine]) -> Samples:
        rows, index = self.of(segment)
        view = self.observation
        pixels, points = view.ridges[segment].pixels, view.points[segment]
        reach = OTHER_MARGIN_WIDTHS * view.width
        beside = view.width_at(pixels) > MERGED_WIDTHS * view.width + 2.0
        touching = np.zeros(len(pixels), bool)
        for line in others:
            near = polylines.least_distances(pixels, line.pixels) < reach
            beside |= near
            if np.any(near):
                gaps = polylines.least_distances(points[near], line.points)
                touching[near] |= gaps < 2.0 * self._rope.radius + OTHER_MARGIN
        kept = ~np.where(rows[:, 3] > 0.0, touching[index], beside[index])
        return rows[kept], index[kept]

    def _compute(self, segment: int) -> Samples:
        s, i = self._settings, self._camera.intrinsics
        view, ridge = self.observation, self.observation.ridges[segment]
        sigma = float(np.hypot(s.depth_sigma, s.depth_quantum / np.sqrt(12.0)))
        sigma = max(sigma, s.min_depth_sigma)
        pixels = ridge.pixels[ridge.clear]
        index = np.flatnonzero(ridge.clear)
        rays = self._camera.rays(pixels)
        lateral = np.zeros((len(pixels), 6))
        lateral[:, :3] = poses.normalized(rays)
        lateral[:, 5] = s.fit.ray_sigma / i.fx
        normals = ridge.normals[index]
        offsets = np.array(_flank_offsets(view.width))
        at = np.rint(pixels + offsets[:, None, None] * normals).reshape(-1, 2)
        # Each pixel is one measurement, however many ridge points lie next to it.
        flat = (at[:, 1] * i.width + at[:, 0]).astype(np.int64)
        _, once = np.unique(flat, return_index=True)
        measured = sample_depth(view.depth, at[once])
        once, measured = once[measured > 0.0], measured[measured > 0.0] - view.bias
        nearest = once % len(pixels)
        offset = np.vecdot(at[once] - pixels[nearest], normals[nearest]) * measured / i.fx
        rays = self._camera.rays(at[once])
        stretch = np.linalg.norm(rays, axis=1)
        ranged = np.zeros((len(once), 6))
        ranged[:, :3] = rays / stretch[:, None]
        ranged[:, 3] = measured * stretch
        ranged[:, 4] = np.sqrt(np.maximum(self._rope.radius**2 - offset**2, 0.0))
        ranged[:, 5] = sigma
        return np.concatenate([lateral, ranged]), np.concatenate([index, index[nearest]])


def node_anchors(
    start: Float64[np.ndarray, "n 3"],
    sliding: float,
    prior: ShapePrior | None,
    left: Pose | None,
    right: Pose | None,
    rope: RopeDimensions,
    settings: CenterlineSettings,
) -> Float64[np.ndarray, "n 4"]:
    """Return the expected position of each node and its standard deviation, 0 for none [m].

    Args:
        start: Initial node positions [m].
        sliding: Standard deviation of a shift of the whole rope along itself [m].
        prior: Expected shape; None where there is none.
        left: Grip of the left end; None when it is free or unknown.
        right: Grip of the right end.
        rope: Length and number of nodes.
        settings: Uncertainty of grips and free ends.
    """
    n = rope.node_count
    edge = rope.length / (n - 1)
    anchors = np.zeros((n, 4))
    if prior is not None:
        anchors[:, :3], anchors[:, 3] = prior.positions, prior.sigma
    elif left is None and right is None:
        # Rays and ranges leave the position along the rope open: its own ends must fix it.
        for end in (0, -1):
            sigma = np.hypot(sliding, settings.hypotheses.free_end_sigma)
            anchors[end] = *start[end], sigma
    z = np.array([0.0, 0.0, edge])
    sigma, factor = settings.grip_sigma, settings.grip_tangent_factor
    if left is not None:
        anchors[0] = *left.position, sigma
        anchors[1] = *left.apply(z), factor * sigma
    if right is not None:
        anchors[-1] = *right.position, sigma
        anchors[-2] = *right.apply(-z), factor * sigma
    return anchors


def _flank_offsets(width: float) -> list[float]:
    """Offsets across a ridge, from its axis outwards, of pixels that surely show the rope."""
    count = int(np.clip(width / 2.0 - FLANK_MARGIN, 0.0, MAX_FLANK_OFFSET))
    return [0.0, *(float(s * k) for k in range(1, count + 1) for s in (-1, 1))]
