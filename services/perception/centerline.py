"""From one RGB-D frame to the nodes of the rope, each with its standard deviation.

Bright pixels, thinned to strands; a sub-pixel ridge along each strand; the strands put in order by
an expected shape or by their gaps; an inextensible chain fitted to the ridge's rays and to the
ranges on and beside it, with both grips as anchors where they are known. What no range speaks for
is bridged and marked as not observed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, UInt8, UInt16

from services.perception.assembly import Order, joined, order_along, order_between
from services.perception.fit import ChainFit, Fit, FitSettings
from services.perception.ridge import Ridge, ridge, sampled
from services.perception.segmentation import bright_region
from services.perception.skeleton import strands
from shared.geometry import polylines, poses
from shared.geometry.cameras import Camera
from shared.geometry.poses import Pose

LEAST_LENGTH = 0.1
"""Less than this part of the rope in view is no view of it."""


@dataclass(frozen=True)
class RopeModel:
    """What perception must know of the rope."""

    length: float
    """[m]."""
    radius: float
    """[m]."""
    node_count: int
    """Nodes at equal distance along it."""


@dataclass(frozen=True)
class CenterlineSettings:
    """How images are read."""

    threshold: int = 128
    """Least brightness of the rope, 1..254."""
    depth_sigma: float = 0.0015
    """Standard deviation of one depth [m]."""
    depth_quantum: float = 0.001
    """Step of the depth values [m]."""
    grip_sigma: float = 0.0003
    """Deviation of a grip's position as seen by the camera: calibration [m]."""
    fit: FitSettings = FitSettings()


@dataclass(frozen=True)
class Expected:
    """Where the rope is thought to be."""

    positions: Float64[np.ndarray, "n 3"]
    """[m]."""
    sigma: Float64[np.ndarray, "n"]
    """[m]."""


@dataclass(frozen=True)
class Estimate:
    """Where the rope was seen; `lost` says why it was not."""

    positions: Float64[np.ndarray, "n 3"]
    """[m]; no rows when lost."""
    sigma: Float64[np.ndarray, "n"]
    """Standard deviation of each position, all directions together [m]."""
    observed: Bool[np.ndarray, "n"]
    """False where the position is bridged."""
    lost: str = ""
    """Why there are no positions; empty otherwise."""
    misfit: float = 1.0
    """Residuals over their expected size."""


def _lost(reason: str) -> Estimate:
    return Estimate(np.zeros((0, 3)), np.zeros(0), np.zeros(0, bool), reason)


class CenterlineEstimator:
    """Reads frames of one camera for one rope; keeps nothing between frames."""

    def __init__(
        self, camera: Camera, rope: RopeModel, settings: CenterlineSettings | None = None
    ) -> None:
        self.camera = camera
        self.rope = rope
        self.settings = settings or CenterlineSettings()
        self._fit = ChainFit(rope.node_count, rope.length, self.settings.fit)

    def estimate(
        self,
        color: UInt8[np.ndarray, "h w 3"],
        depth: UInt16[np.ndarray, "h w"],
        left: Pose | None = None,
        right: Pose | None = None,
        expected: Expected | None = None,
    ) -> Estimate:
        """The rope in one frame.

        Args:
            color: Red, green, blue.
            depth: [mm], 0 where nothing was measured.
            left: Grip that holds the left end; None when it is free or unknown.
            right: Grip that holds the right end.
            expected: The last estimate or a prediction.
        """
        i = self.camera.intrinsics
        if color.shape[:2] != (i.height, i.width) or depth.shape != (i.height, i.width):
            return _lost(
                f"images are {color.shape[1]} x {color.shape[0]} and {depth.shape[1]} x "
                f"{depth.shape[0]}, the calibration says {i.width} x {i.height}"
            )
        region = bright_region(color, self.settings.threshold)
        if region is None:
            return _lost(f"no pixel is brighter than {self.settings.threshold}")
        width = self._width(depth, region.mask, region.left, region.top)
        if width is None:
            return _lost("no depth where the image is bright")
        ridges = [ridge(s, region, depth, width) for s in strands(region.mask, width)]
        ridges = [r for r in ridges if np.any(np.isfinite(r.depth))]
        points = [self._axis(r) for r in ridges]
        seen = sum(polylines.length(p) for p in points)
        if seen < LEAST_LENGTH * self.rope.length:
            return _lost(f"only {1e3 * seen:.0f} mm of rope in view")
        best: Estimate | None = None
        for order, prior in self._candidates(points, left, right, expected):
            found = self._fitted(ridges, points, order, depth, left, right, prior, width)
            if best is None or found.misfit < best.misfit:
                best = found
            if best.misfit < 2.0:
                break
        return best or _lost("nothing bright lies where the rope can be")

    def _width(
        self, depth: UInt16[np.ndarray, "h w"], mask: UInt8[np.ndarray, "h w"], x: int, y: int
    ) -> float | None:
        """Of the rope in the image [pixels]."""
        part = depth[y : y + mask.shape[0], x : x + mask.shape[1]]
        values = part[(mask > 0) & (part > 0)]
        if len(values) < 10:
            return None
        near = float(np.percentile(values, 30)) / 1000.0
        return 2.0 * self.rope.radius * self.camera.intrinsics.fx / near

    def _axis(self, found: Ridge) -> Float64[np.ndarray, "k 3"]:
        """Points near the axis, gaps in depth interpolated [m]."""
        known = np.isfinite(found.depth)
        index = np.arange(len(known))
        depth = np.interp(index, index[known], found.depth[known])
        half = min(6, (len(depth) - 1) // 2)
        padded = np.pad(depth, half, mode="edge")
        depth = np.convolve(padded, np.full(2 * half + 1, 1.0 / (2 * half + 1)), "valid")
        surface = self.camera.back_project(found.pixels, depth)
        ray = poses.normalized(self.camera.rays(found.pixels))
        return surface + self.rope.radius * ray

    def _candidates(
        self,
        points: list[Float64[np.ndarray, "k 3"]],
        left: Pose | None,
        right: Pose | None,
        expected: Expected | None,
    ) -> list[tuple[Order, Expected | None]]:
        """Orders of the pieces, the most likely first, and what each rests on."""
        found: list[tuple[Order, Expected | None]] = []
        if expected is not None:
            reach = 0.03 + 2.0 * float(np.max(expected.sigma))
            found.append((order_along(expected.positions, points, reach), expected))
        found.append((order_between(points, left, right, self.rope.length), None))
        return [(order, prior) for order, prior in found if order.indices]

    def _fitted(
        self,
        ridges: list[Ridge],
        points: list[Float64[np.ndarray, "k 3"]],
        order: Order,
        depth: UInt16[np.ndarray, "h w"],
        left: Pose | None,
        right: Pose | None,
        expected: Expected | None,
        width: float,
    ) -> Estimate:
        n = self.rope.node_count
        chosen = [
            _flipped(ridges[i], points[i]) if flip else (ridges[i], points[i])
            for i, flip in zip(order.indices, order.flipped, strict=True)
        ]
        curve, places = joined([p for _, p in chosen], left, right, self.rope.length)
        start = polylines.resampled(curve, n)
        rows, segments = [], []
        for (found, _), place in zip(chosen, places, strict=True):
            samples, index = self._samples(found, depth, width)
            rows.append(samples)
            segments.append((place[index] * (n - 1)).astype(np.int32))
        fit = self._fit.solve(
            start,
            np.concatenate(rows),
            np.minimum(np.concatenate(segments), n - 2),
            self.camera.T_world_camera.position,
            self._anchors(left, right, expected),
            None if expected is None else expected.positions,
        )
        return self._judged(fit)

    def _samples(
        self, found: Ridge, depth: UInt16[np.ndarray, "h w"], width: float
    ) -> tuple[Float64[np.ndarray, "m 7"], np.ndarray]:
        """Rows for the fit and the ridge point that each belongs to."""
        s, i = self.settings, self.camera.intrinsics
        sigma = float(np.hypot(s.depth_sigma, s.depth_quantum / np.sqrt(12.0)))
        sigma = max(sigma, 2e-4)
        pixels = found.pixels[found.clear]
        index = np.flatnonzero(found.clear)
        rays = self.camera.rays(pixels)
        lateral = np.zeros((len(pixels), 7))
        lateral[:, :3] = poses.normalized(rays)
        lateral[:, 6] = s.fit.ray_sigma / i.fx
        blocks, indices = [lateral], [index]
        taken = np.zeros(0, int)
        for offset in _offsets(width):
            at = np.rint(pixels + offset * found.normals[index])
            measured = sampled(depth, at)
            flat = (at[:, 1] * i.width + at[:, 0]).astype(int)
            # Every pixel is one measurement, however many ridge points lie beside it.
            _, first = np.unique(flat, return_index=True)
            keep = np.zeros(len(at), bool)
            keep[first] = True
            keep &= ~np.isin(flat, taken) & (measured > 0.0)
            taken = np.concatenate([taken, flat[keep]])
            away = np.sum((at - pixels) * found.normals[index], axis=1) * measured / i.fx
            rays = self.camera.rays(at[keep])
            stretch = np.linalg.norm(rays, axis=1)
            block = np.zeros((int(np.count_nonzero(keep)), 7))
            block[:, :3] = rays / stretch[:, None]
            block[:, 3] = measured[keep] * stretch
            r = self.rope.radius
            block[:, 4] = np.sqrt(np.maximum(r**2 - away[keep] ** 2, 0.0))
            block[:, 5] = sigma
            blocks.append(block)
            indices.append(index[keep])
        return np.concatenate(blocks), np.concatenate(indices)

    def _anchors(
        self, left: Pose | None, right: Pose | None, expected: Expected | None
    ) -> Float64[np.ndarray, "n 4"]:
        n = self.rope.node_count
        edge = self.rope.length / (n - 1)
        anchors = np.zeros((n, 4))
        if expected is not None:
            anchors[:, :3], anchors[:, 3] = expected.positions, expected.sigma
        z = np.array([0.0, 0.0, edge])
        sigma = self.settings.grip_sigma
        if left is not None:
            anchors[0] = *left.position, sigma
            anchors[1] = *left.apply(z), 1.5 * sigma
        if right is not None:
            anchors[-1] = *right.position, sigma
            anchors[-2] = *right.apply(-z), 1.5 * sigma
        return anchors

    def _judged(self, fit: Fit) -> Estimate:
        # A misfit means that the noise is larger than assumed, or that the order is wrong.
        sigma = fit.sigma * max(1.0, fit.misfit)
        return Estimate(fit.nodes, sigma, fit.support > 1.0, misfit=fit.misfit)


def _offsets(width: float) -> list[float]:
    """Across the ridge: pixels that are surely rope."""
    count = int(max(0.0, width / 2.0 - 1.5))
    return [0.0, *(float(s * k) for k in range(1, count + 1) for s in (-1, 1))]


def _flipped(
    found: Ridge, points: Float64[np.ndarray, "k 3"]
) -> tuple[Ridge, Float64[np.ndarray, "k 3"]]:
    back = Ridge(found.pixels[::-1], -found.normals[::-1], found.clear[::-1], found.depth[::-1])
    return back, points[::-1]
