"""Known scene, and its depth at pixels of a camera by sphere tracing."""

from __future__ import annotations

import numpy as np

from lariat.geometry.cameras import Camera, Intrinsics, looking_at
from lariat.geometry.depth_solid import SolidRange
from lariat.geometry.obstacles import TABLE, Obstacle, scene_distance

SCENE = (
    TABLE,
    Obstacle("box", (0.05, 0.1, 0.06), (0.9689, 0.0, 0.0, 0.2474), size=(0.2, 0.08, 0.12)),
    Obstacle("cylinder", (-0.15, 0.0, 0.1), radius=0.03, height=0.2),
    Obstacle("sphere", (0.15, -0.12, 0.1), radius=0.05),
)
"""Table with a box, a post and a ball in the air."""
CAMERA = Camera(
    Intrinsics.symmetric(320, 240, np.deg2rad(60.0)), looking_at((0.1, -0.35, 0.9), (0.0, 0.0, 0.0))
)
EXTENT = SolidRange(far=1.5, floor=0.004)


def depths(pixels: np.ndarray, camera: Camera = CAMERA) -> np.ndarray:
    """Depth of the scene at pixels, by sphere tracing; infinite where nothing is hit [m]."""
    rays = camera.rays(pixels.reshape(-1, 2))
    sizes = np.linalg.norm(rays, axis=1)
    depth = np.full(len(rays), 0.05)
    for _ in range(300):
        depth += scene_distance(camera.T_world_camera.position + depth[:, None] * rays, SCENE) / (
            sizes
        )
    found = np.where(depth < 5.0, depth, np.inf)
    return found.reshape(pixels.shape[:-1])


def image_of(camera: Camera = CAMERA) -> np.ndarray:
    """Depth at the centre of each pixel [m]."""
    size = camera.intrinsics.height, camera.intrinsics.width
    rows, columns = np.indices(size)
    return depths(np.stack([columns, rows], axis=-1).astype(float), camera)
