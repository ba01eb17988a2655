"""Ropes and other thin things beside the held rope, of any colour, found by their depth.

They are nearer to the camera than what lies on both of their sides, and belong neither to the held
rope nor to a gripper or an obstacle of the scene. What has the held rope's colour is left to the
tracker, which tells both apart where they lie on each other.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64, UInt8, UInt16

from lariat.geometry import polylines, poses
from lariat.geometry.cameras import Camera
from lariat.geometry.obstacles import Obstacle, scene_distance
from services.perception.beside.nearness import near_mask, nearness
from services.perception.beside.other_ropes import SeenLine
from services.perception.centerline.estimate import CenterlineEstimate, OtherLine
from services.perception.centerline.foreign_strands import BesideStrand
from services.perception.centerline.other_lines import join_strands
from services.perception.centerline.ridge import Ridge, axis_points, extract_ridge, sample_depth
from services.perception.centerline.segmentation import Region
from services.perception.centerline.skeleton import trace_strands

MAX_DIAMETER = 0.03
"""Diameter up to which a thing is thin [m]."""
LEAST_NEARNESS = 0.4
"""Least distance from what lies behind it, in diameters of the held rope [-]."""
MAX_RANGE = 1.5
"""Depth above which nothing is sought, for noise grows with it, relative to that of the farthest
node of the held rope [-]."""
MIN_LENGTH = 0.04
"""Length below which a thing is left out [m]."""
MIN_SLENDERNESS = 4.0
"""Length of a thing below which it is no rope, in diameters of its own [-]."""
CHAIN_MARGIN = 3.0
"""Distance from the flank of the held rope up to which a pixel shows it [pixels]."""
CHAIN_SIGMAS = 2.0
"""The same for its uncertainty [standard deviations]."""
MAX_CHAIN_ERROR = 0.01
"""Largest value of the latter [m]: of a rope that may lie elsewhere, the colour tells."""
BODY_MARGIN = 0.005
"""Distance from an obstacle up to which a pixel shows it [m]."""
GRIPPER_MARGIN = 0.015
"""The same for a gripper, whose capsule is coarse [m]."""
OUTLINE = 7
"""Side of the square around a pixel of a body in which depths may be mixtures [pixels]."""
MIN_COLOR_DISTANCE = 40.0
"""Distance of two colours in Lab below which the tracker may take one for the other [-]."""
DEPTH_HALF_WINDOW = 8
"""Half the window along a strand over which its depth is averaged [pixels]."""
MAX_STEP = 0.01
"""Difference in depth of two neighbouring points of one thing [m]."""
PROFILE_MARGIN = 6
"""Reach of a profile across a strand beyond its flanks [pixels]."""
FLANK_LOSS = 0.5
"""What a profile loses at both flanks together, where depths are mixtures or missing [pixels]."""
PROFILE_STEP = 0.1
"""Distance of the points at which a profile is compared with half its height [pixels]."""


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


@dataclass(frozen=True)
class RgbdView:
    """Images of one camera."""

    color: UInt8[np.ndarray, "h w 3"]
    """Red, green, blue."""
    depth: UInt16[np.ndarray, "h w"]
    """Depth [mm], 0 where nothing was measured."""
    camera: Camera
    """The camera."""
    bias: float = 0.0
    """Bias of every depth [m]."""


def thin_things(view: RgbdView, known: KnownScene, depth_sigma: float) -> list[SeenLine]:
    """Return the thin things in images that nothing known explains, longest first.

    Args:
        view: The images.
        known: What is known to be there.
        depth_sigma: Standard deviation of a single depth [m].
    """
    color, depth, camera, bias = view.color, view.depth, view.camera, view.bias
    focus = camera.intrinsics.fx
    nodes, z = camera.project(known.rope.positions)
    far = float(np.max(z))
    least = LEAST_NEARNESS * 2.0 * known.radius
    widest = round(MAX_DIAMETER * focus / far) | 1
    difference, smooth, count = nearness(depth, widest)
    mask = near_mask(difference, count, least, depth_sigma)
    mask[smooth > 1e3 * MAX_RANGE * far] = 0
    _erase_rope(mask, nodes, focus / z, known)
    _erase_bodies(mask, smooth, camera, known, bias)
    region = _long_parts(mask, difference, 1e3 * least, MIN_LENGTH * focus / far)
    if region is None:
        return []
    width = 2.0 * known.radius * focus / far
    held = color[_at(nodes[known.rope.observed], depth.shape)]
    if not len(held):
        # What is seen might be the held rope itself.
        return []
    strands = []
    for strand in trace_strands(region.mask, width):
        ridge = extract_ridge(strand, region, depth, width)
        for piece in _without_steps(ridge, widest):
            if not _looks_like(piece, color, held):
                points = axis_points(piece, camera, known.radius - bias, DEPTH_HALF_WINDOW)
                strands.append(BesideStrand(piece.pixels, points))
    found = []
    for line in join_strands(strands, width):
        diameter = _diameter(line, depth, camera, known.radius - bias, widest)
        outward = poses.normalized(camera.rays(line.pixels))
        points = line.points + (0.5 * diameter - known.radius) * outward
        length = polylines.length(polylines.resample(points, max(2, len(points) // 5)))
        thin = least < diameter < MAX_DIAMETER
        if thin and length > max(MIN_LENGTH, MIN_SLENDERNESS * diameter):
            found.append(SeenLine(points, diameter))
    return found


def _erase_rope(
    mask: UInt8[np.ndarray, "h w"],
    nodes: Float64[np.ndarray, "n 2"],
    pixels_per_metre: Float64[np.ndarray, "n"],
    known: KnownScene,
) -> None:
    """Set the pixels around the held rope to zero."""
    off = np.minimum(CHAIN_SIGMAS * known.rope.sigma, MAX_CHAIN_ERROR)
    reach = (known.radius + off) * pixels_per_metre + CHAIN_MARGIN
    corners = np.rint(nodes).astype(int)
    for a, b, r in zip(corners[:-1], corners[1:], np.maximum(reach[:-1], reach[1:]), strict=True):
        cv2.line(mask, a.tolist(), b.tolist(), 0, 2 * round(float(r)) + 1)


def _erase_bodies(
    mask: UInt8[np.ndarray, "h w"],
    depth: UInt16[np.ndarray, "h w"],
    camera: Camera,
    known: KnownScene,
    bias: float,
) -> None:
    """Set the pixels of obstacles and grippers to zero, with those on their outlines.

    Half spaces are never thin, and what lies on them is not to be taken for them.
    """
    found = cv2.findNonZero(mask)
    if found is None:
        return
    pixels = found.reshape(-1, 2).astype(float)
    columns, rows = found.reshape(-1, 2).T
    points = camera.back_project(pixels, 1e-3 * depth[rows, columns] - bias)
    bodies = [o for o in known.obstacles if o.shape != "half_space" and not o.keep_in]
    shown = scene_distance(points, bodies) < BODY_MARGIN
    shown |= scene_distance(points, known.grippers) < GRIPPER_MARGIN
    bodies_mask = np.zeros_like(mask)
    bodies_mask[rows[shown], columns[shown]] = 1
    mask[cv2.dilate(bodies_mask, np.ones((OUTLINE, OUTLINE), np.uint8)) > 0] = 0


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
    _, labels, stats, _ = cv2.connectedComponentsWithStats(near, connectivity=8)
    sides = stats[:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]]
    kept = np.hypot(*sides.T) >= min_length
    kept[0] = False
    if not np.any(kept):
        return None
    low = stats[kept, : cv2.CC_STAT_WIDTH].min(axis=0)
    high = (stats[kept, : cv2.CC_STAT_WIDTH] + sides[kept]).max(axis=0)
    part = np.s_[low[1] : high[1], low[0] : high[0]]
    corner = left + int(low[0]), top + int(low[1])
    nearer = difference[top : top + height, left : left + width][part]
    likeness = np.minimum(128.0 / least * nearer, 255.0).astype(np.uint8)
    return Region(likeness, kept[labels[part]].view(np.uint8), *corner)


def _without_steps(ridge: Ridge, min_count: int) -> Iterator[Ridge]:
    """Yield the pieces of a ridge between steps of its depth, where it leads over another thing.

    Args:
        ridge: The ridge.
        min_count: Number of points below which a piece is left out.
    """
    (known,) = np.nonzero(np.isfinite(ridge.depth))
    steps = np.abs(np.diff(ridge.depth[known])) > MAX_STEP
    for run in np.split(known, np.flatnonzero(steps) + 1):
        if len(run) >= min_count:
            part = slice(run[0], run[-1] + 1)
            yield Ridge(
                ridge.pixels[part], ridge.normals[part], ridge.clear[part], ridge.depth[part]
            )


def _looks_like(
    ridge: Ridge, color: UInt8[np.ndarray, "h w 3"], held: UInt8[np.ndarray, "n 3"]
) -> bool:
    """Whether a strand has the held rope's colour."""
    ours = np.median(held, axis=0)
    theirs = np.median(color[_at(ridge.pixels, color.shape)], axis=0)
    both = np.stack([ours, theirs])[None].astype(np.uint8)
    lab = cv2.cvtColor(both, cv2.COLOR_RGB2LAB)[0].astype(float)
    return float(np.linalg.norm(lab[0] - lab[1])) < MIN_COLOR_DISTANCE


def _diameter(
    line: OtherLine,
    depth: UInt16[np.ndarray, "h w"],
    camera: Camera,
    radius: float,
    widest: int,
) -> float:
    """Diameter of a line [m], between the places where its profile has half its height.

    The profile across it is the median over its length, which noise of single depths hardly moves.

    Args:
        line: The line.
        depth: Depth image [mm].
        camera: Camera of the image.
        radius: Distance from the surface at which the line's points lie [m].
        widest: Largest width of a thin thing [pixels].
    """
    reach = widest // 2 + PROFILE_MARGIN
    tangents = np.gradient(line.pixels, axis=0)
    normals = np.stack([tangents[:, 1], -tangents[:, 0]], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True) + 1e-12
    offsets = np.arange(-reach, reach + 1)
    across = sample_depth(depth, line.pixels[:, None] + offsets[:, None] * normals[:, None])
    near = camera.project(line.points)[1] - radius
    behind = np.ma.masked_array(across - near[:, None], across == 0.0)
    profile = np.ma.median(behind, axis=0)
    known = ~np.ma.getmaskarray(profile)
    if not np.any(known):
        return np.inf
    fine = np.arange(-reach, reach, PROFILE_STEP)
    height = np.interp(fine, offsets[known], profile.data[known])
    outside = height > 0.5 * np.max(height)
    left = np.max(fine[outside & (fine < 0.0)], initial=-reach)
    right = np.min(fine[outside & (fine >= 0.0)], initial=reach)
    width = right - left + FLANK_LOSS
    return float(width * np.median(near) / camera.intrinsics.fx)


def _at(pixels: Float64[np.ndarray, "k 2"], shape: tuple[int, ...]) -> tuple[np.ndarray, ...]:
    """Rows and columns of the nearest pixels of an image."""
    at = np.clip(np.rint(pixels).astype(int), 0, np.array(shape[1::-1]) - 1)
    return at[:, 1], at[:, 0]
