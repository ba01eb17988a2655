"""The simulated RGB-D camera: exact rays, then honest noise, all of it compiled.

Colour is what a headlight would show, with the rope's edge blended into partly covered pixels;
depth is the z coordinate at each pixel's centre in millimetres, 0 where nothing was measured.
A frame depends on its scene, the seed and the frame's number only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float32, Float64, UInt8, UInt16

from lariat.geometry import poses
from lariat.geometry.cameras import Camera
from lariat.geometry.obstacles import Obstacle, pack
from lariat.rod.launch import taichi_runtime
from services.sim.camera.kernels.bodies import draw_bodies
from services.sim.camera.kernels.noise import measure
from services.sim.camera.kernels.plates import draw_plates
from services.sim.camera.kernels.rays import FAR
from services.sim.camera.kernels.rope import draw_chains
from services.sim.camera.marker_plates import Plate

RGB = tuple[int, int, int]

WHITE: RGB = (255, 255, 255)
DARK: RGB = (60, 60, 66)
BLACK: RGB = (12, 12, 12)

GRAIN_STRIDE = 7919
"""Places by which the strip of colour noise moves on from frame to frame, a prime."""
GAUSSIAN_COUNT = 1 << 18
"""Length of the table of normal numbers; rows of an image start anywhere in it."""


@dataclass(frozen=True)
class SensorNoise:
    """What separates a measured frame from the exact one."""

    depth_sigma: float = 0.0015
    """Standard deviation of every depth [m]."""
    depth_bias: float = 0.0
    """Added to every depth [m]."""
    depth_quantum: float = 0.001
    """Step of the depth values [m]."""
    edge_step: float = 0.02
    """Neighbours further apart than this make an edge [m]."""
    edge_mixing: float = 0.5
    """Probability that a pixel on an edge mixes both sides' depths."""
    edge_dropout: float = 0.5
    """Probability that a pixel on an edge has no depth."""
    color_sigma: float = 2.0
    """Standard deviation of every colour value [levels of 255]."""
    exposure: float = 1.0
    """Factor on every colour value."""

    def __post_init__(self) -> None:
        for name in ("depth_sigma", "edge_step", "color_sigma", "exposure"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} must not be negative, got {value}; 0 turns it off")
        if not self.depth_quantum > 0.0:
            raise ValueError(
                f"depth_quantum must be positive, got {self.depth_quantum} m; "
                "depth images hold whole millimetres, so 0.001 is the finest"
            )
        for name in ("edge_mixing", "edge_dropout"):
            value = getattr(self, name)
            if not 0.0 <= value <= 1.0:
                raise ValueError(f"{name} is a probability in 0..1, got {value}")


PERFECT = SensorNoise(
    depth_sigma=0.0, depth_quantum=0.001, edge_mixing=0.0, edge_dropout=0.0, color_sigma=0.0
)
"""Only the quantisation of the images."""


@dataclass(frozen=True)
class Frame:
    """One image pair, both registered to the same pixels."""

    color: UInt8[np.ndarray, "h w 3"]
    """Red, green, blue."""
    depth: UInt16[np.ndarray, "h w"]
    """Depth [mm], 0 where nothing was measured."""


@dataclass(frozen=True)
class _Planes:
    """What lies behind everything else."""

    scene: bytes
    """Of what was drawn."""
    color: UInt8[np.ndarray, "h w3"]
    z_buffer: Float32[np.ndarray, "h w"]
    """[m]."""


class RgbdCamera:
    """Takes pictures of a rope, obstacles and grippers."""

    def __init__(
        self,
        camera: Camera,
        noise: SensorNoise | None = None,
        seed: int = 0,
        rope_color: RGB = WHITE,
        background: int = 4,
    ) -> None:
        """A camera that stands still.

        Args:
            camera: The true pinhole.
            noise: What the sensor adds.
            seed: Of the noise.
            rope_color: Of the rope's face towards the camera.
            background: Grey value where a ray hits nothing.
        """
        taichi_runtime.start()
        self.camera = camera
        self.noise = noise or SensorNoise()
        self._seed = seed
        self._rope_color = rope_color
        self._background = background
        shape = (camera.intrinsics.height, camera.intrinsics.width)
        self._scratch = [np.zeros(shape, np.float32) for _ in range(3)]
        self._planes: _Planes | None = None
        random = np.random.default_rng(seed)
        self._gaussian = random.standard_normal(GAUSSIAN_COUNT, np.float32)
        # A frame's grain is a window of a longer strip: drawing it afresh would cost 10 ms.
        strip = random.standard_normal(3 * shape[0] * shape[1] + 999_983)
        grain = np.rint(strip * self.noise.color_sigma).astype(np.int16)
        self._grain = grain if self.noise.color_sigma > 0.0 else None
        i, pose = camera.intrinsics, camera.T_world_camera
        self._packed_camera = np.concatenate(
            [
                [i.fx, i.fy, i.cx, i.cy],
                poses.matrix(pose.orientation).ravel(),
                pose.position,
            ]
        )

    def take(
        self,
        chain: Float64[np.ndarray, "n 3"],
        radius: float,
        obstacles: Sequence[Obstacle] = (),
        colors: Sequence[RGB] | None = None,
        frame: int = 0,
        plates: Sequence[Plate] = (),
    ) -> Frame:
        """The image of a chain of capsules among obstacles.

        Args:
            chain: The rope's nodes in the world [m].
            radius: Of the rope [m].
            obstacles: Everything else that can be seen, grippers included.
            colors: One for each obstacle; dark, and the half spaces nearly black, by default.
            frame: Number of the frame, which selects its noise.
            plates: Printed on or above the obstacles.
        """
        n, i = self.noise, self.camera.intrinsics
        if colors is None:
            colors = [BLACK if o.shape == "half_space" else DARK for o in obstacles]
        capsules = np.empty((len(chain) - 1, 10))
        capsules[:, 0:3], capsules[:, 3:6] = chain[:-1], chain[1:]
        capsules[:, 6] = radius
        capsules[:, 7:10] = np.minimum(np.array(self._rope_color) * n.exposure, 255.0)
        color = np.empty((i.height, i.width, 3), np.uint8)
        depth = np.empty((i.height, i.width), np.uint16)
        flat = color.reshape(i.height, 3 * i.width)
        z_buffer, cover, shade = self._scratch
        bodies = pack(obstacles).reshape(-1, 12)
        tints = np.minimum(np.array(colors, float).reshape(-1, 3) * n.exposure, 255.0)
        endless = np.array([o.shape == "half_space" for o in obstacles], bool)
        planes = self._drawn_planes(bodies[endless], tints[endless])
        np.copyto(flat, planes.color)
        np.copyto(z_buffer, planes.z_buffer)
        draw_bodies(flat, z_buffer, self._packed_camera, bodies[~endless], tints[~endless])
        if plates:
            packed = np.array([plate.packed for plate in plates])
            patterns = np.stack([plate.pattern for plate in plates])
            draw_plates(flat, z_buffer, self._packed_camera, packed, patterns)
        draw_chains(flat, z_buffer, cover, shade, self._packed_camera, capsules)
        measure(
            depth,
            z_buffer,
            self._gaussian,
            np.array(
                [
                    n.depth_sigma,
                    n.depth_bias,
                    n.depth_quantum,
                    n.edge_step,
                    n.edge_mixing,
                    n.edge_dropout,
                ]
            ),
            (self._seed * 2654435761 + frame * 40503 + 1) & 0xFFFFFFFF,
        )
        if self._grain is None:
            return Frame(color, depth)
        start = frame * GRAIN_STRIDE % (self._grain.size - color.size)
        grain = self._grain[start : start + color.size].reshape(color.shape)
        # One pass that saturates.
        return Frame(np.asarray(cv2.add(color, grain, dtype=cv2.CV_8U), np.uint8), depth)

    def _drawn_planes(
        self, bodies: Float64[np.ndarray, "m 12"], tints: Float64[np.ndarray, "m 3"]
    ) -> _Planes:
        """Half spaces alone, drawn when they change: they fill the image and stand still."""
        scene = bodies.tobytes() + tints.tobytes()
        if self._planes is None or self._planes.scene != scene:
            i = self.camera.intrinsics
            grey = min(round(self._background * self.noise.exposure), 255)
            color = np.full((i.height, 3 * i.width), grey, np.uint8)
            z_buffer = np.full((i.height, i.width), FAR, np.float32)
            draw_bodies(color, z_buffer, self._packed_camera, bodies, tints)
            self._planes = _Planes(scene, color, z_buffer)
        return self._planes
