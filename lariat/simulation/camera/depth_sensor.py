"""Sensor that reports exact depths with noise.

The noise of every pixel is added in whole arrays, by NumPy's vector instructions; a kernel visits
the pixels at edges alone.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float32, UInt8, UInt16, UInt32
from numpy.lib.stride_tricks import sliding_window_view

from lariat.simulation.camera.camera_kernels import CameraKernels
from lariat.simulation.camera.kernels.depths import BLOCK_SHIFT, FAR, STILL
from lariat.simulation.camera.sensor_noise import SensorNoise

MILLIMETER = 0.001
"""Step of the depth images [m]."""
LARGEST = 65535.0
"""Largest value of a depth image [mm]."""
TABLE_SIZE = 1 << 18
"""Length of the table of noise; every image row starts at a random element of it."""
SEED_MULTIPLIER, FRAME_MULTIPLIER = 2654435761, 40503
"""Factors of seed and frame in the seed of the noise, near 2^32 and 2^16 over the golden ratio
(multiplicative hashing, Knuth, The Art of Computer Programming, vol. 3) [-]."""


class DepthSensor:
    """Depth sensor whose noise depends on seed and frame only."""

    def __init__(
        self,
        kernels: CameraKernels,
        noise: SensorNoise,
        shape: tuple[int, int],
        seed: int,
        random: np.random.Generator,
    ) -> None:
        """Create a sensor.

        Args:
            kernels: Kernels of the camera.
            noise: Noise settings.
            shape: Height and width of the images [pixels].
            seed: Seed that the frames' own seeds are made from.
            random: Source of the table of noise.
        """
        self._kernels = kernels
        self._noise = noise
        self._seed = seed
        self._rows = mixed_bits(np.arange(1, shape[0] + 1, dtype=np.uint32))
        table = random.standard_normal(TABLE_SIZE, np.float32)
        table *= noise.depth_sigma
        table += noise.depth_bias
        self._windows = sliding_window_view(table, shape[1])
        self._edge_noise = np.array(
            [noise.depth_quantum, noise.edge_step, noise.edge_mixing, noise.edge_dropout]
        )

    def mark_still(
        self, z_buffer: Float32[np.ndarray, "h w"], marks: UInt8[np.ndarray, "h b"]
    ) -> None:
        """Mark the blocks of an image of what stands still that have edges, or show nothing.

        Args:
            z_buffer: Exact depths [m].
            marks: Marks of the blocks, replaced.
        """
        height, width = z_buffer.shape
        marked = np.zeros((height, marks.shape[1] << BLOCK_SHIFT), bool)
        pixels = marked[:, :width]
        np.greater_equal(z_buffer, FAR, out=pixels)
        across = np.abs(np.diff(z_buffer, axis=1)) > self._noise.edge_step
        down = np.abs(np.diff(z_buffer, axis=0)) > self._noise.edge_step
        pixels[:, 1:] |= across
        pixels[:, :-1] |= across
        pixels[1:] |= down
        pixels[:-1] |= down
        marks[:] = STILL * marked.reshape(*marks.shape, -1).any(axis=2)

    def measure(
        self, z_buffer: Float32[np.ndarray, "h w"], marks: UInt8[np.ndarray, "h b"], frame: int
    ) -> UInt16[np.ndarray, "h w"]:
        """Return the depths that the sensor reports [mm], 0 where nothing was measured.

        Args:
            z_buffer: Exact depths [m].
            marks: Blocks in which there may be edges, as in `kernels.edges`.
            frame: Number of the frame.
        """
        quantum = np.float32(self._noise.depth_quantum)
        seed = (self._seed * SEED_MULTIPLIER + frame * FRAME_MULTIPLIER + 1) & 0xFFFFFFFF
        keys = mixed_bits(self._rows ^ np.uint32(seed))
        values = self._windows[keys % np.uint32(len(self._windows) - 1)]
        values += z_buffer
        values *= np.float32(1.0) / quantum
        values += 0.5
        if self._noise.depth_quantum != MILLIMETER:
            np.floor(values, out=values)
            values *= quantum
            values *= 1e3
            values += 0.5
        np.clip(values, 0.0, LARGEST, out=values)
        depth = values.astype(np.uint16)
        self._kernels.disturb_edges(depth, z_buffer, marks, keys, self._edge_noise)
        return depth


def mixed_bits(numbers: UInt32[np.ndarray, "n"]) -> UInt32[np.ndarray, "n"]:
    """Return hashes with full avalanche (lowbias32, Wellons 2018), as `kernels.edges` does."""
    numbers = numbers ^ (numbers >> 16)
    numbers *= np.uint32(0x7FEB352D)
    numbers ^= numbers >> 15
    numbers *= np.uint32(0x846CA68B)
    return numbers ^ (numbers >> 16)
