"""Pinhole cameras.

Conventions: the optical frame has x to the right, y down and z forward; the centre of the pixel in
column u and row v has the coordinates (u, v), so the principal point of a symmetric camera is
((width - 1) / 2, (height - 1) / 2); depth is the z coordinate in the optical frame, not the range.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float64, UInt8

from lariat.geometry import poses
from lariat.geometry.poses import Pose

Picture = UInt8[np.ndarray, "h w 3"] | UInt8[np.ndarray, "h w"]
"""Red, green, blue; or the brightness, where nothing else is needed."""


MAX_OFF_CENTER = 0.1
"""Distance of the principal point from the middle, in widths or heights, that is plausible [-]."""
MIN_VIEW, MAX_VIEW = math.radians(5.0), math.radians(130.0)
"""Plausible fields of view without distortion [rad]."""


@dataclass(frozen=True)
class Intrinsics:
    """Intrinsic parameters of a pinhole camera without lens distortion.

    Raises:
        ValueError: The image is empty, or a focal length is not positive and finite.
    """

    width: int
    """Columns [pixels]."""
    height: int
    """Rows [pixels]."""
    fx: float
    """Focal length along the columns [pixels]."""
    fy: float
    """Focal length along the rows [pixels]."""
    cx: float
    """Column of the principal point [pixels]."""
    cy: float
    """Row of the principal point [pixels]."""

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise ValueError(
                f"an image needs at least one pixel, got {self.width} x {self.height}; "
                "give width and height in pixels"
            )
        numbers = (self.fx, self.fy, self.cx, self.cy)
        if not all(map(math.isfinite, numbers)) or self.fx <= 0.0 or self.fy <= 0.0:
            raise ValueError(
                f"focal lengths must be positive and finite, got (fx, fy, cx, cy) = {numbers}; "
                "calibrate the camera or use Intrinsics.symmetric"
            )

    @property
    def doubt(self) -> str:
        """Sign that they are of another picture, in words; empty without one."""
        size, center, focal = (self.width, self.height), (self.cx, self.cy), (self.fx, self.fy)
        if any(abs(c / n - 0.5) > MAX_OFF_CENTER for c, n in zip(center, size, strict=True)):
            return (
                f"the principal point ({self.cx:g}, {self.cy:g}) is far from the middle of the "
                f"{self.width} x {self.height} picture, as in one of about {2 * self.cx:.0f} x "
                f"{2 * self.cy:.0f}; give the intrinsics of this size"
            )
        views = [2.0 * math.atan(n / (2.0 * f)) for n, f in zip(size, focal, strict=True)]
        if max(views) > MAX_VIEW or min(views) < MIN_VIEW:
            wide, high = (math.degrees(view) for view in views)
            return (
                f"the focal lengths ({self.fx:g}, {self.fy:g}) show {wide:.3g} x {high:.3g} "
                "degrees; give them in pixels of this picture"
            )
        return ""

    @staticmethod
    def symmetric(width: int, height: int, horizontal_view: float) -> Intrinsics:
        """Return intrinsics with square pixels and the principal point in the middle.

        Args:
            width: Columns [pixels].
            height: Rows [pixels].
            horizontal_view: Angle between the left and the right edge of the image [rad].
        """
        f = width / 2.0 / math.tan(horizontal_view / 2.0)
        return Intrinsics(width, height, f, f, (width - 1) / 2.0, (height - 1) / 2.0)

    def project(
        self, points: Float64[np.ndarray, "*b 3"]
    ) -> tuple[Float64[np.ndarray, "*b 2"], Float64[np.ndarray, "*b"]]:
        """Return pixel coordinates (u, v) and depth [m] of points in the optical frame [m].

        Points behind the camera have a depth <= 0 and meaningless pixel coordinates.
        """
        points = np.asarray(points, float)
        depth = points[..., 2]
        safe = np.where(depth == 0.0, np.nan, depth)
        u = self.fx * points[..., 0] / safe + self.cx
        v = self.fy * points[..., 1] / safe + self.cy
        return np.stack([u, v], axis=-1), depth

    def back_project(
        self, pixels: Float64[np.ndarray, "*b 2"], depth: Float64[np.ndarray, "*b"]
    ) -> Float64[np.ndarray, "*b 3"]:
        """Return the points in the optical frame [m] at pixels (u, v) and depths [m]."""
        pixels, depth = np.asarray(pixels, float), np.asarray(depth, float)
        x = (pixels[..., 0] - self.cx) / self.fx * depth
        y = (pixels[..., 1] - self.cy) / self.fy * depth
        return np.stack([x, y, np.broadcast_to(depth, x.shape)], axis=-1)


@dataclass(frozen=True)
class Camera:
    """Pinhole camera at a pose in the world."""

    intrinsics: Intrinsics
    """Intrinsic parameters."""
    T_world_camera: Pose
    """Pose of the optical frame in the world."""

    def project(
        self, points: Float64[np.ndarray, "*b 3"]
    ) -> tuple[Float64[np.ndarray, "*b 2"], Float64[np.ndarray, "*b"]]:
        """Return pixel coordinates (u, v) and depth [m] of points in the world [m]."""
        from_camera = np.asarray(points, float) - self.T_world_camera.position
        return self.intrinsics.project(from_camera @ self._rotation)

    def back_project(
        self, pixels: Float64[np.ndarray, "*b 2"], depth: Float64[np.ndarray, "*b"]
    ) -> Float64[np.ndarray, "*b 3"]:
        """Return the points in the world [m] at pixels (u, v) and depths [m]."""
        local = self.intrinsics.back_project(pixels, depth)
        return local @ self._rotation.T + self.T_world_camera.position

    def rays(self, pixels: Float64[np.ndarray, "*b 2"]) -> Float64[np.ndarray, "*b 3"]:
        """Return world directions of the rays through pixels (u, v), scaled to unit depth."""
        pixels = np.asarray(pixels, float)
        local = self.intrinsics.back_project(pixels, np.ones(pixels.shape[:-1]))
        return local @ self._rotation.T

    @cached_property
    def _rotation(self) -> Float64[np.ndarray, "3 3"]:
        """Rotation matrix of the pose: one product takes a tenth of the time of quaternions."""
        return poses.matrix(self.T_world_camera.orientation)


def looking_at(
    eye: tuple[float, float, float],
    target: tuple[float, float, float],
    up: tuple[float, float, float] | None = None,
) -> Pose:
    """Return T_world_camera of a camera at `eye` with `target` on its optical axis.

    Args:
        eye: Centre of projection [m].
        target: Point on the optical axis, in front of the camera [m].
        up: Direction that points upwards in the image; must not be along the optical axis. By
            default the world's z, or its y for a camera that looks straight up or down.

    Raises:
        ValueError: `up` is along the optical axis.
    """
    forward = np.subtract(target, eye)
    if up is None:
        upright = np.hypot(forward[0], forward[1]) > 1e-6 * np.linalg.norm(forward)
        up = (0.0, 0.0, 1.0) if upright else (0.0, 1.0, 0.0)
    right = np.cross(forward, up)
    if np.linalg.norm(right) < 1e-9 * np.linalg.norm(forward) * np.linalg.norm(up):
        raise ValueError(
            f"the upward direction is undefined: eye={eye}, target={target} and up={up} lie on "
            "one line; give another `up`"
        )
    z = forward / np.linalg.norm(forward)
    x = right / np.linalg.norm(right)
    return Pose(np.asarray(eye, float), poses.from_matrix(np.stack([x, np.cross(z, x), z], 1)))
