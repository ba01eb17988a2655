"""Pixels that are nearer than what surrounds them, and that nothing known explains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64, UInt8, UInt16

from lariat.geometry.cameras import Camera
from lariat.geometry.obstacles import Obstacle, scene_distance
from lariat.perception.centerline.estimate import CenterlineEstimate
from lariat.perception.lines.segmentation import Region
from lariat.perception.other_ropes.relative_depth import SmoothDepth, near_mask, relative_depth

MAX_DIAMETER = 0.03
"""Diameter up to which a thing is thin [m]."""
LEAST_RELATIVE_DEPTH = 0.4
"""Least distance from what lies behind it, in diameters of the held rope [-]."""
MAX_RANGE = 1.5
"""Depth above which nothing is sought, for noise grows with it, relative to that of the farthest
node of the held rope [-]."""
CHAIN_SIGMAS = 2.0
"""Distance from the held rope up to which a pixel shows it, for its uncertainty [standard
deviations]."""
MAX_CHAIN_ERROR = 0.01
"""Largest value of the latter [m]: of a rope that may lie elsewhere, the colour tells."""
BODY_MARGIN = 0.005
"""Distance from an obstacle up to which a pixel shows it [m]."""
GRIPPER_MARGIN = 0.015
"""The same for a gripper, whose capsule is coarse [m]."""
MIN_LENGTH_SHARE = 0.7
"""Number of pixels of a connected part, relative to its length, of which it has at least [-]."""


@dataclass(frozen=True)
class Scale:
    """How pixels are compared at a resolution."""

    least_share: float
    """Share of the least distance in front from which a pixel is near [-]."""
    min_length: float
    """Length below which a part is left out [m]."""
    rope_margin: float
    """Distance from the flank of the held rope up to which a pixel shows it [pixels]."""
    outline: int
    """Side of the square around a pixel of a body in which depths may be mixtures [pixels]."""


@dataclass(frozen=True)
class KnownScene:
    """What a camera may see besides unmodelled things."""

    rope: CenterlineEstimate
    """The held rope."""
    radius: float
    """Radius of the held rope [m]."""
    obstacles: Sequence[Obstacle]
    """Obstacles where they are now."""
    grippers: Sequence[Obstacle]
    """Capsules of the grippers."""


def least_relative_depth(scene: KnownScene) -> float:
    """Return the least distance of a thing from what lies behind it [m]."""
    return LEAST_RELATIVE_DEPTH * 2.0 * scene.radius


def widest(camera: Camera, far: float) -> int:
    """Return the width of the widest thin thing [pixels], an odd number.

    Args:
        camera: Camera of the image.
        far: Depth of the farthest node of the held rope [m].
    """
    return round(MAX_DIAMETER * camera.intrinsics.fx / far) | 1


def foreground_mask(
    smooth: SmoothDepth,
    camera: Camera,
    scene: KnownScene,
    bias: float,
    depth_sigma: float,
    scale: Scale,
) -> Region | None:
    """Return the region of the long parts that are near; None without any.

    Args:
        smooth: Depths.
        camera: Camera of their image.
        scene: What is known to be there.
        bias: Bias of every depth [m].
        depth_sigma: Standard deviation of a single depth [m].
        scale: How pixels are compared.
    """
    focus = camera.intrinsics.fx
    nodes, z = camera.project(scene.rope.positions)
    far = float(np.max(z))
    least, min_length = (
        scale.least_share * least_relative_depth(scene),
        scale.min_length * focus / far,
    )
    difference = relative_depth(smooth.depth, widest(camera, far))
    sigma = scale.least_share * depth_sigma
    mask = near_mask(difference, smooth, least, sigma, MAX_RANGE * far)
    _erase_rope(mask, nodes, focus / z, scene, scale.rope_margin)
    # Half spaces are never thin, and what lies on them is not to be taken for them.
    solid = [o for o in scene.obstacles if o.shape != "half_space" and not o.keep_in]
    region = _long_parts(mask, difference, 1e3 * least, min_length)
    if region is None:
        return None
    # Distances from bodies are dear: they are computed for what is long alone.
    height, width = region.mask.shape
    mask[:] = 0
    mask[region.top : region.top + height, region.left : region.left + width] = region.mask
    for bodies, margin in ((scene.grippers, GRIPPER_MARGIN), (solid, BODY_MARGIN)):
        _erase_bodies(mask, smooth.depth, camera, bodies, margin, bias, scale.outline)
    return _long_parts(mask, difference, 1e3 * least, min_length)


def _erase_rope(
    mask: UInt8[np.ndarray, "h w"],
    nodes: Float64[np.ndarray, "n 2"],
    pixels_per_metre: Float64[np.ndarray, "n"],
    scene: KnownScene,
    margin: float,
) -> None:
    """Set the pixels around the held rope to zero."""
    off = np.minimum(CHAIN_SIGMAS * scene.rope.sigma, MAX_CHAIN_ERROR)
    reach = (scene.radius + off) * pixels_per_metre + margin
    corners = np.rint(nodes).astype(int)
    for a, b, r in zip(corners[:-1], corners[1:], np.maximum(reach[:-1], reach[1:]), strict=True):
        cv2.line(mask, a.tolist(), b.tolist(), 0, 2 * round(float(r)) + 1)


def _erase_bodies(
    mask: UInt8[np.ndarray, "h w"],
    depth: UInt16[np.ndarray, "h w"],
    camera: Camera,
    bodies: Sequence[Obstacle],
    margin: float,
    bias: float,
    outline: int,
) -> None:
    """Set the pixels up to a margin from bodies to zero, with those on their outlines."""
    kept = cv2.findNonZero(mask)
    if kept is None or not bodies:
        return
    pixels = kept.reshape(-1, 2).astype(float)
    columns, rows = kept.reshape(-1, 2).T
    points = camera.back_project(pixels, 1e-3 * depth[rows, columns] - bias)
    shown = scene_distance(points, bodies) < margin
    if not np.any(shown):
        return
    bodies_mask = np.zeros_like(mask)
    bodies_mask[rows[shown], columns[shown]] = 1
    mask[cv2.dilate(bodies_mask, np.ones((outline, outline), np.uint8)) > 0] = 0


def _long_parts(
    mask: UInt8[np.ndarray, "h w"],
    difference: UInt16[np.ndarray, "h w"],
    least: float,
    min_length: float,
) -> Region | None:
    """Region of the connected parts that may be long enough; None without any.

    Args:
        mask: 1 at near pixels.
        difference: How much nearer each pixel is [mm].
        least: Least difference that counts [mm].
        min_length: Length of the shortest part [pixels].
    """
    left, top, width, height = cv2.boundingRect(mask)
    if np.hypot(width, height) < min_length:
        return None
    near = mask[top : top + height, left : left + width]
    count, labels = cv2.connectedComponents(near, connectivity=8)
    # Counted by OpenCV, their extents take several times as long as the components.
    pixels = np.asarray(cv2.findNonZero(near)).reshape(-1, 2)
    number = labels[pixels[:, 1], pixels[:, 0]]
    size = np.bincount(number, minlength=count)
    kept = size > MIN_LENGTH_SHARE * min_length
    if not np.any(kept):
        return None
    chosen = kept[number]
    # Pixels part by part.
    pixels = pixels[chosen][np.argsort(number[chosen], kind="stable")]
    begins = np.concatenate([[0], np.cumsum(size[kept])[:-1]])
    low, high = np.minimum.reduceat(pixels, begins), np.maximum.reduceat(pixels, begins) + 1
    long = np.hypot(*(high - low).T) >= min_length
    if not np.any(long):
        return None
    kept[kept] = long
    low, high = np.min(low[long], axis=0), np.max(high[long], axis=0)
    part = np.s_[low[1] : high[1], low[0] : high[0]]
    corner = left + int(low[0]), top + int(low[1])
    nearer = difference[top : top + height, left : left + width][part]
    likeness = np.minimum(128.0 / least * nearer, 255.0).astype(np.uint8)
    return Region(likeness, kept[labels[part]].view(np.uint8), *corner)
