"""Ropes and other thin things beside the held rope, of any colour, found by their depth.

They are nearer to the camera than what lies on both of their sides, and belong neither to the held
rope nor to a gripper or an obstacle of the scene. What has the held rope's colour is left to the
tracker, which tells both apart where they lie on each other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64, UInt8, UInt16
from scipy.ndimage import uniform_filter1d

from lariat.geometry import polylines, poses
from lariat.geometry.cameras import Camera, Intrinsics
from lariat.perception.centerline.estimate import OtherLine
from lariat.perception.centerline.foreign_strands import BesideStrand, between_steps
from lariat.perception.centerline.other_lines import join_strands
from lariat.perception.lines.ridge import extract_ridge, sample_depth
from lariat.perception.lines.skeleton import trace_strands
from lariat.perception.other_ropes.foreground_mask import (
    MAX_DIAMETER,
    KnownScene,
    Scale,
    foreground_mask,
    least_relative_depth,
    widest,
)
from lariat.perception.other_ropes.other_ropes import SeenLine
from lariat.perception.other_ropes.relative_depth import SMOOTHING, reduced, smoothed

MIN_LENGTH = 0.04
"""Length below which a thing is left out [m]."""
MIN_SLENDERNESS = 4.0
"""Length of a thing below which it is no rope, in diameters of its own [-]."""
FINE = Scale(least_share=1.0, min_length=MIN_LENGTH, rope_margin=3.0, outline=7)
"""How pixels of the images are compared."""
COARSE = Scale(least_share=0.75, min_length=0.5 * MIN_LENGTH, rope_margin=2.0, outline=3)
"""The same in a smaller image, in which nothing is to be missed."""
COARSE_PIXELS = 3.0
"""Width of the held rope in pixels of the images for one in the smaller image [-]."""
MIN_COLOR_DISTANCE = 40.0
"""Distance of two colours in Lab below which the tracker may take one for the other [-]."""
MIN_CONTRAST = 20.0
"""Distance in Lab of a line from the ground from which on its colour tells its width [-]."""
TANGENT_LENGTH = 21
"""Length over which the points of a line are averaged for its tangents [points]."""
PROFILE_MARGIN = 6
"""Reach of a profile across a strand beyond its flanks [pixels]."""
FLANK_LOSS = 0.5
"""What a profile of depth loses at both flanks together, where depths are mixtures or missing
[pixels]."""
PROFILE_STEP = 0.1
"""Distance of the points at which a profile is compared with half its height [pixels]."""


@dataclass(frozen=True)
class RgbdView:
    """Images of one camera."""

    color: Callable[[], UInt8[np.ndarray, "h w 3"]]
    """Function that returns red, green, blue, which are decoded only where they are used."""
    depth: UInt16[np.ndarray, "h w"]
    """Depth [mm], 0 where nothing was measured."""
    camera: Camera
    """The camera."""
    bias: float = 0.0
    """Bias of every depth [m]."""


def thin_structures(view: RgbdView, scene: KnownScene, depth_sigma: float) -> list[SeenLine]:
    """Return the thin things in images that nothing known explains, longest first.

    A smaller image tells where to look.

    Args:
        view: The images.
        scene: What is known to be there.
        depth_sigma: Standard deviation of a single depth [m].
    """
    far = float(np.max(view.camera.project(scene.rope.positions)[1]))
    k = max(2, round(2.0 * scene.radius * view.camera.intrinsics.fx / far / COARSE_PIXELS))
    # Of so many depths is a pixel of the smaller image the mean, and of SMOOTHING squared here.
    sigma = depth_sigma * k / SMOOTHING
    camera = _reduced(view.camera, k)
    region = foreground_mask(reduced(view.depth, k), camera, scene, view.bias, sigma, COARSE)
    if region is None:
        return []
    margin = 2 * widest(view.camera, far)
    height, width = region.mask.shape
    left, top = max(0, k * region.left - margin), max(0, k * region.top - margin)
    right, bottom = k * (region.left + width) + margin, k * (region.top + height) + margin
    return _lines(view, scene, depth_sigma, np.s_[top:bottom, left:right])


def _lines(
    view: RgbdView, scene: KnownScene, depth_sigma: float, part: tuple[slice, slice]
) -> list[SeenLine]:
    """Thin things in a part of the images, longest first."""
    depth, bias = view.depth[part], view.bias
    camera = _cropped(view.camera, part, depth.shape)
    region = foreground_mask(smoothed(depth), camera, scene, bias, depth_sigma, FINE)
    if region is None:
        return []
    far = float(np.max(camera.project(scene.rope.positions)[1]))
    width, most = 2.0 * scene.radius * camera.intrinsics.fx / far, widest(camera, far)
    rope_pixels = view.camera.project(scene.rope.positions[scene.rope.observed])[0]
    if not len(rope_pixels):
        # What is seen might be the held rope itself.
        return []
    ridges = [extract_ridge(s, region, depth, width) for s in trace_strands(region.mask, width)]
    radius = scene.radius - bias
    strands = [s for ridge in ridges for s in between_steps(ridge, camera, radius, most)]
    if not strands:
        return []
    color = view.color()
    ours, shown = np.median(color[_at(rope_pixels, color.shape)], axis=0), color[part]
    strands = [s for s in strands if not _looks_like(s, shown, ours)]
    seen = []
    for line in join_strands(strands, width):
        diameter = _diameter(line, shown, depth, camera, radius, most)
        outward = poses.normalized(camera.rays(line.pixels))
        points = line.points + (0.5 * diameter - scene.radius) * outward
        length = polylines.length(polylines.resample(points, max(2, len(points) // 5)))
        thin = least_relative_depth(scene) < diameter < MAX_DIAMETER
        if thin and length > max(MIN_LENGTH, MIN_SLENDERNESS * diameter):
            seen.append(SeenLine(points, diameter))
    return seen


def _reduced(camera: Camera, k: int) -> Camera:
    """Camera whose pixels are squares of k by k of a camera's."""
    i, off = camera.intrinsics, 0.5 * (k - 1)
    size, center = (i.width // k, i.height // k), ((i.cx - off) / k, (i.cy - off) / k)
    return Camera(Intrinsics(*size, i.fx / k, i.fy / k, *center), camera.T_world_camera)


def _cropped(camera: Camera, part: tuple[slice, slice], shape: tuple[int, ...]) -> Camera:
    """Camera of a part of a camera's image."""
    i, (rows, columns) = camera.intrinsics, part
    cropped = Intrinsics(shape[1], shape[0], i.fx, i.fy, i.cx - columns.start, i.cy - rows.start)
    return Camera(cropped, camera.T_world_camera)


def _looks_like(
    strand: BesideStrand, color: UInt8[np.ndarray, "h w 3"], ours: Float64[np.ndarray, "3"]
) -> bool:
    """Whether a strand has the held rope's colour."""
    theirs = np.median(color[_at(strand.pixels, color.shape)], axis=0)
    both = np.stack([ours, theirs])[None].astype(np.uint8)
    lab = cv2.cvtColor(both, cv2.COLOR_RGB2LAB)[0].astype(float)
    return float(np.linalg.norm(lab[0] - lab[1])) < MIN_COLOR_DISTANCE


def _diameter(
    line: OtherLine,
    color: UInt8[np.ndarray, "h w 3"],
    depth: UInt16[np.ndarray, "h w"],
    camera: Camera,
    radius: float,
    widest: int,
) -> float:
    """Diameter of a line [m], between the places where its profile has half its height.

    The profile across it is the median over its length, which noise of single pixels hardly moves:
    of colour, for depths of near things bleed over what lies behind, or of depth, where the ground
    has the line's colour.

    Args:
        line: The line.
        color: Colour image.
        depth: Depth image [mm].
        camera: Camera of the images.
        radius: Distance from the surface at which the line's points lie [m].
        widest: Largest width of a thin thing [pixels].
    """
    reach = widest // 2 + PROFILE_MARGIN
    # A tangent that wavers would stretch the profile.
    tangents = np.gradient(uniform_filter1d(line.pixels, TANGENT_LENGTH, axis=0), axis=0)
    normals = np.stack([tangents[:, 1], -tangents[:, 0]], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True) + 1e-12
    offsets = np.arange(-reach, reach + 1)
    around = line.pixels[:, None] + offsets[:, None] * normals[:, None]
    near, loss = camera.project(line.points)[1] - radius, 0.0
    profile = _color_profile(color, around)
    if np.max(profile) < MIN_CONTRAST:
        profile, loss = _depth_profile(sample_depth(depth, around), near), FLANK_LOSS
    measured = np.isfinite(profile)
    if not np.any(measured):
        return np.inf
    fine = np.arange(-reach, reach, PROFILE_STEP)
    height = np.interp(fine, offsets[measured], profile[measured])
    outside = height > 0.5 * np.max(height)
    left = np.max(fine[outside & (fine < 0.0)], initial=-reach)
    right = np.min(fine[outside & (fine >= 0.0)], initial=reach)
    return float((right - left + loss) * np.median(near) / camera.intrinsics.fx)


def _color_profile(
    color: UInt8[np.ndarray, "h w 3"], around: Float64[np.ndarray, "n m 2"]
) -> Float64[np.ndarray, "m"]:
    """Distance in Lab from the colour in the middle, from one side of a line to the other."""
    seen = np.median(color[_at(around, color.shape)], axis=0)
    lab = cv2.cvtColor(seen[None].astype(np.uint8), cv2.COLOR_RGB2LAB)[0].astype(float)
    return np.linalg.norm(lab - lab[len(lab) // 2], axis=1)


def _depth_profile(
    across: Float64[np.ndarray, "n m"], near: Float64[np.ndarray, "n"]
) -> Float64[np.ndarray, "m"]:
    """Depth behind a line's surface [m], from one side of it to the other; NaN where not measured.

    Args:
        across: Depths around each point of the line [m], 0 where nothing was measured.
        near: Depth of its surface [m].
    """
    # Sorted with the missing ones last: medians of masked arrays take ten times as long.
    behind = np.sort(np.where(across > 0.0, across - near[:, None], np.inf).T, axis=1)
    count, row = np.count_nonzero(across, axis=0), np.arange(across.shape[1])
    profile = 0.5 * (behind[row, (count - 1) // 2] + behind[row, count // 2])
    return np.where(count > 0, profile, np.nan)


def _at(pixels: Float64[np.ndarray, "*k 2"], shape: tuple[int, ...]) -> tuple[np.ndarray, ...]:
    """Rows and columns of the nearest pixels of an image."""
    at = np.clip(np.rint(pixels).astype(int), 0, np.array(shape[1::-1]) - 1)
    return at[..., 1], at[..., 0]
