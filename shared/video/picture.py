"""Picture of a cell at one instant: table, obstacles, rope, grippers, goal and planned path.

Bodies are painted from far to near, each as the shaded outline of its projection.
"""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from lariat.geometry import Camera, Intrinsics, looking_at
from lariat.geometry.obstacles import Obstacle
from shared.video.framing import VIEW_ANGLE
from shared.video.recorded_run import Instant
from shared.video.surfaces import surface

Color = tuple[int, int, int]
"""Colour: blue, green, red."""
SKY: Color = (40, 33, 30)
TABLE: Color = (74, 62, 56)
GRID: Color = (92, 79, 72)
BODY: Color = (176, 158, 140)
SUPPORT: Color = (120, 160, 120)
ARM: Color = (196, 190, 184)
ROPE: Color = (60, 160, 245)
OTHER_ROPE: Color = (120, 170, 150)
GRIPPER: Color = (90, 70, 215)
GOAL: Color = (220, 70, 220)
PATH: Color = (200, 190, 90)
SHADOW: Color = (50, 41, 37)
LIGHT = np.array([0.35, -0.5, 0.8]) / np.linalg.norm([0.35, -0.5, 0.8])
"""Direction to the light."""
NEAREST_DEPTH = 0.05
"""Depth below which nothing is painted [m]."""
TABLE_POINTS = 81
"""Number of points along each line of the table."""
FINE = 4
"""Number of binary digits of a pixel coordinate behind its point."""


class Renderer:
    """Renderer of instants, seen by one camera."""

    def __init__(
        self,
        size: tuple[int, int],
        eye: tuple[float, float, float],
        target: tuple[float, float, float],
        view: float = VIEW_ANGLE,
    ) -> None:
        self.size = size
        self._camera = Camera(Intrinsics.symmetric(*size, view), looking_at(eye, target))
        self._eye = np.array(eye)
        self._ground = self._painted_ground()

    def paint(
        self, instant: Instant, radius: float, gripper_radius: float
    ) -> UInt8[np.ndarray, "h w 3"]:
        """Return the picture of an instant, blue first."""
        image = self._ground.copy()
        for body in (*instant.obstacles, *instant.arms):
            self._hull(image, _on_table(surface(body).points), SHADOW)
        self._line(image, _on_table(instant.nodes), SHADOW, radius)
        for way in instant.path:
            self._line(image, way, PATH, 0.001)
        parts: list[tuple[float, object]] = [
            (self._distance(np.array(b.position)), b) for b in (*instant.obstacles, *instant.arms)
        ]
        arms = set(instant.arms)
        nodes = instant.nodes
        parts += [
            (self._distance(nodes[k : k + 2].mean(0)), nodes[k : k + 2])
            for k in range(len(nodes) - 1)
        ]
        parts += [(self._distance(axis.mean(0)), (axis,)) for axis in instant.grips]
        for line in instant.others:
            self._line(image, _on_table(line), SHADOW, radius)
            self._line(image, line, OTHER_ROPE, radius)
        self._line(image, instant.goal, GOAL, 0.4 * radius)
        for _, part in sorted(parts, key=lambda pair: -pair[0]):
            if isinstance(part, Obstacle):
                color = ARM if part in arms else SUPPORT if part.support else BODY
                self._body(image, part, color)
            elif isinstance(part, tuple):
                self._line(image, part[0], GRIPPER, gripper_radius)
            else:
                self._line(image, np.asarray(part), ROPE, radius)
        self._line(image, nodes + 0.4 * radius * LIGHT, (140, 205, 255), 0.25 * radius)
        overlay = image.copy()
        self._line(overlay, instant.goal, GOAL, 0.4 * radius)
        return cv2.addWeighted(overlay, 0.45, image, 0.55, 0.0)

    def _painted_ground(self) -> np.ndarray:
        width, height = self.size
        image = np.empty((height, width, 3), np.uint8)
        image[:] = SKY
        # Points behind the camera are left out, so that edges are drawn by many.
        along = np.linspace(-1.0, 1.0, TABLE_POINTS)
        across, flat = np.meshgrid(along, along), np.zeros(TABLE_POINTS)
        places = np.stack([across[0], across[1], np.zeros_like(across[0])], axis=-1)
        self._hull(image, places.reshape(-1, 3), TABLE)
        for at in np.linspace(-1.0, 1.0, 21):
            fixed = np.full(TABLE_POINTS, at)
            self._line(image, np.column_stack([fixed, along, flat]), GRID, 0.0008)
            self._line(image, np.column_stack([along, fixed, flat]), GRID, 0.0008)
        return image

    def _body(self, image: np.ndarray, body: Obstacle, color: Color) -> None:
        """Paint a body: its outline, and its faces by their light."""
        faces = surface(body)
        pixels, depth = self._camera.project(faces.points)
        if depth.min() < NEAREST_DEPTH:
            return
        corners = np.round(pixels * 2**FINE).astype(np.int32)
        self._fill(image, corners, _shaded(color, 0.55))
        begin = 0
        for end, normal in zip(faces.ends, faces.normals, strict=True):
            if normal @ (self._eye - faces.points[begin:end].mean(0)) > 0.0:
                light = 0.5 + 0.5 * max(float(normal @ LIGHT), 0.0)
                self._fill(image, corners[begin:end], _shaded(color, light))
            begin = end

    def _distance(self, point: np.ndarray) -> float:
        return float(np.linalg.norm(point - self._eye))

    def _pixels(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pixels in fixed point, and depths [m]; points behind the camera are left out."""
        pixels, depth = self._camera.project(np.asarray(points, float))
        front = depth > NEAREST_DEPTH
        return np.round(pixels[front] * 2**FINE).astype(np.int32), depth[front]

    def _hull(self, image: np.ndarray, points: np.ndarray, color: Color) -> None:
        pixels, _ = self._pixels(points)
        if len(pixels) >= 3:
            self._fill(image, pixels, color)

    @staticmethod
    def _fill(image: np.ndarray, pixels: np.ndarray, color: Color) -> None:
        cv2.fillConvexPoly(image, cv2.convexHull(pixels), color, cv2.LINE_AA, FINE)

    def _line(self, image: np.ndarray, points: np.ndarray, color: Color, radius: float) -> None:
        pixels, depth = self._pixels(points)
        if len(pixels) >= 2:
            scale = self._camera.intrinsics.fx / float(depth.mean())
            thickness = max(1, round(2.0 * radius * scale))
            cv2.polylines(image, [pixels], False, color, thickness, cv2.LINE_AA, FINE)


def _shaded(color: Color, light: float) -> Color:
    blue, green, red = (round(min(255.0, light * c)) for c in color)
    return blue, green, red


def _on_table(points: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, "n 3"]:
    """Shadows of points on the table."""
    return points - points[:, 2:] / LIGHT[2] * LIGHT
