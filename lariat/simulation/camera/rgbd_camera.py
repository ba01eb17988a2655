"""Simulated RGB-D camera: ray casting, then sensor noise, in compiled kernels.

The scene is lit from the camera; the rope's edges are blended into partly covered pixels. Depth is
the z coordinate at the centre of each pixel in millimetres, 0 where nothing was measured. A frame
depends on its scene, the seed and the number of the frame only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float32, Float64, UInt8, UInt16

from lariat.geometry import poses
from lariat.geometry.cameras import Camera
from lariat.geometry.obstacles import PACKED_WIDTH, Obstacle, pack
from lariat.simulation.camera.camera_kernels import CameraKernels
from lariat.simulation.camera.color_noise import ColorNoise
from lariat.simulation.camera.depth_faults import DepthFaults
from lariat.simulation.camera.depth_sensor import DepthSensor
from lariat.simulation.camera.kernels.depths import BLOCK_SHIFT, DRAWN, FAR
from lariat.simulation.camera.marker_plates import MarkerPlate, pattern
from lariat.simulation.camera.sensor_noise import SensorNoise

RGB = tuple[int, int, int]
"""Red, green, blue [1/255]."""

ROPE_COLOR: RGB = (255, 255, 255)
"""Default colour of the rope."""
BODY_COLOR: RGB = (60, 60, 66)
"""Default colour of obstacles and grippers."""
HALF_SPACE_COLOR: RGB = (12, 12, 12)
"""Default colour of half spaces."""

STRAND_OVERLAP = 2.0
"""Depth behind another strand of the same rope up to which edge pixels are blended [radii]."""
TUBE_OVERLAP = 0.0
"""The same behind anything of another colour, which would show through [radii]."""


@dataclass(frozen=True)
class Frame:
    """Colour and depth image, registered to the same pixels."""

    color: UInt8[np.ndarray, "h w 3"]
    """Red, green, blue [1/255]."""
    depth: UInt16[np.ndarray, "h w"]
    """Depth [mm], 0 where nothing was measured."""


@dataclass(frozen=True)
class Tube:
    """Chain of capsules in view, e.g. another rope."""

    nodes: Float64[np.ndarray, "n 3"]
    """Points of its axis [m]."""
    radius: float
    """Radius of its cross-section [m]."""
    color: RGB
    """Colour where it faces the camera."""


class _Image(NamedTuple):
    """Image that is drawn; the first arguments of the kernels that draw."""

    color: UInt8[np.ndarray, "h 3*w"]
    """Red, green, blue [1/255]."""
    z_buffer: Float32[np.ndarray, "h w"]
    """Exact depth [m]."""
    marks: UInt8[np.ndarray, "h b"]
    """Marks of its blocks, as in `kernels.depths`."""

    def restore(self, still: _Image) -> None:
        """Replace the rows over which something was drawn by those of what stands still."""
        rows = np.flatnonzero(np.any(self.marks == DRAWN, axis=1))
        if len(rows):
            drawn = slice(rows[0], rows[-1] + 1)
            for part, original in zip(self, still, strict=True):
                part[drawn] = original[drawn]


@dataclass(frozen=True)
class _Background:
    """Image of the bodies and plates that stand still."""

    bodies: Float64[np.ndarray, "m 16"]
    """Packed bodies and their colours, in the order in which they were drawn."""
    plates: Float64[np.ndarray, "p 11"]
    """Packed plates and the identities of their markers, drawn after the bodies."""
    image: _Image
    """The image."""

    def begins(
        self, bodies: Float64[np.ndarray, "k 16"], plates: Float64[np.ndarray, "q 11"]
    ) -> bool:
        """Return whether bodies and plates begin with those of the image, at the same places."""
        return all(
            len(still) <= len(present) and np.array_equal(still, present[: len(still)])
            for still, present in ((self.bodies, bodies), (self.plates, plates))
        )


class RgbdCamera:
    """Camera that sees a rope, obstacles, grippers and marker plates."""

    def __init__(
        self,
        camera: Camera,
        noise: SensorNoise | None = None,
        seed: int = 0,
        rope_color: RGB = ROPE_COLOR,
        background: int = 4,
        faults: DepthFaults | None = None,
    ) -> None:
        """Create a camera.

        Args:
            camera: True pinhole and pose.
            noise: Noise settings; the defaults if None.
            seed: Seed of the noise.
            rope_color: Colour of the rope where it faces the camera.
            background: Grey value where a ray hits nothing [1/255].
            faults: Further errors of the depth images; none by default.
        """
        self._kernels = CameraKernels()
        self.camera = camera
        self.noise = noise or SensorNoise()
        self._seed = seed
        self._faults = faults
        self._rope_color = rope_color
        self._background_grey = background
        shape = (camera.intrinsics.height, camera.intrinsics.width)
        self._cover, self._shade = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
        self._background: _Background | None = None
        self._last: tuple[Float64[np.ndarray, "k 16"], Float64[np.ndarray, "q 11"]] | None = None
        random = np.random.default_rng(seed)
        self._depth_sensor = DepthSensor(self._kernels, self.noise, shape, seed, random)
        self._color_noise = ColorNoise(self.noise.color_sigma, 3 * shape[0] * shape[1], random)
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
        plates: Sequence[MarkerPlate] = (),
        tubes: Sequence[Tube] = (),
    ) -> Frame:
        """Take an image of a rope among obstacles.

        Args:
            chain: Nodes of the rope in the world [m].
            radius: Radius of the rope [m].
            obstacles: All other bodies, grippers included.
            colors: Colour of each obstacle; `BODY_COLOR` and `HALF_SPACE_COLOR` by default.
            frame: Number of the frame, which selects its noise.
            plates: Marker plates.
            tubes: Other ropes, hands and arms.
        """
        n, i = self.noise, self.camera.intrinsics
        if colors is None:
            colors = [
                HALF_SPACE_COLOR if o.shape == "half_space" else BODY_COLOR for o in obstacles
            ]
        tints = np.minimum(np.array(colors, float).reshape(-1, 3) * n.exposure, 255.0)
        # Half spaces first: they fill the image and seldom move.
        order = np.argsort([o.shape != "half_space" for o in obstacles], kind="stable")
        bodies = np.hstack([pack(obstacles).reshape(-1, PACKED_WIDTH), tints])[order]
        rows = np.array([(*p.packed, p.identity) for p in plates]).reshape(-1, 11)
        background = self._draw_background(bodies, rows)
        image = self._image
        self._draw_bodies(image, bodies[len(background.bodies) :])
        self._draw_plates(image, rows[len(background.plates) :])
        self._draw_tube(image, Tube(chain, radius, self._rope_color), STRAND_OVERLAP)
        # After the rope: a tube that lies beneath it must not show through its edges.
        for tube in tubes:
            self._draw_tube(image, tube, TUBE_OVERLAP)
        depth = self._depth_sensor.measure(image.z_buffer, image.marks, frame)
        if self._faults is not None:
            exact = image.color.reshape(i.height, i.width, 3)
            depth = self._faults.apply(depth, exact, self._seed, frame)
        color = self._color_noise.added(image.color, frame)
        return Frame(color.reshape(i.height, i.width, 3), depth)

    def _draw_tube(self, image: _Image, tube: Tube, overlap: float) -> None:
        """Draw a chain of capsules over an image."""
        capsules = np.empty((len(tube.nodes) - 1, 10))
        capsules[:, 0:3], capsules[:, 3:6] = tube.nodes[:-1], tube.nodes[1:]
        capsules[:, 6] = tube.radius
        capsules[:, 7:10] = np.minimum(np.array(tube.color) * self.noise.exposure, 255.0)
        self._kernels.draw_rope(
            *image, self._cover, self._shade, self._packed_camera, capsules, overlap
        )

    def _draw_background(
        self, bodies: Float64[np.ndarray, "k 16"], plates: Float64[np.ndarray, "q 11"]
    ) -> _Background:
        """Draw what has not moved since the last frame, or restore its image; return it."""
        last, self._last = self._last, (bodies, plates)
        if self._background is not None and self._background.begins(bodies, plates):
            self._image.restore(self._background.image)
            return self._background
        if last is not None:
            bodies, plates = (
                bodies[: _equal_rows(last[0], bodies)],
                plates[: _equal_rows(last[1], plates)],
            )
        i = self.camera.intrinsics
        grey = min(round(self._background_grey * self.noise.exposure), 255)
        image = _Image(
            np.full((i.height, 3 * i.width), grey, np.uint8),
            np.full((i.height, i.width), FAR, np.float32),
            np.zeros((i.height, -(-i.width >> BLOCK_SHIFT)), np.uint8),
        )
        self._draw_bodies(image, bodies)
        self._draw_plates(image, plates)
        self._depth_sensor.mark_still(image.z_buffer, image.marks)
        self._background = _Background(bodies, plates, image)
        self._image = _Image(*(part.copy() for part in image))
        return self._background

    def _draw_bodies(self, image: _Image, bodies: Float64[np.ndarray, "k 16"]) -> None:
        """Draw bodies over an image, in their order."""
        packed, tints = (
            np.ascontiguousarray(bodies[:, :PACKED_WIDTH]),
            np.ascontiguousarray(bodies[:, PACKED_WIDTH:]),
        )
        self._kernels.draw_bodies(*image, self._packed_camera, packed, tints)

    def _draw_plates(self, image: _Image, plates: Float64[np.ndarray, "q 11"]) -> None:
        """Draw plates over an image, in their order."""
        if len(plates):
            packed = np.ascontiguousarray(plates[:, :10])
            patterns = np.stack([pattern(int(identity)) for identity in plates[:, 10]])
            self._kernels.draw_plates(*image, self._packed_camera, packed, patterns)


def _equal_rows(a: Float64[np.ndarray, "n k"], b: Float64[np.ndarray, "m k"]) -> int:
    """Return the number of rows at the beginning of two arrays that are the same."""
    count = min(len(a), len(b))
    different = np.flatnonzero(np.any(a[:count] != b[:count], axis=1))
    return int(different[0]) if len(different) else count
