from __future__ import annotations

import numpy as np
import pytest

from lariat.simulation.camera.camera_kernels import CameraKernels
from lariat.simulation.camera.depth_sensor import DepthSensor
from lariat.simulation.camera.kernels.depths import BLOCK_SHIFT, FAR
from lariat.simulation.camera.sensor_noise import SensorNoise

HEIGHT, WIDTH = 48, 100
"""Size of an image, of no whole number of blocks [pixels]."""


def measured(z_buffer: np.ndarray, noise: SensorNoise, frame: int = 0) -> np.ndarray:
    sensor = DepthSensor(CameraKernels(), noise, z_buffer.shape, 3, np.random.default_rng(3))
    marks = np.zeros((HEIGHT, -(-WIDTH >> BLOCK_SHIFT)), np.uint8)
    sensor.mark_still(z_buffer, marks)
    return sensor.measure(z_buffer, marks, frame)


def ramp() -> np.ndarray:
    """Depths that rise slowly over the image [m]."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    return (0.5 + 3.1e-4 * columns + 1.7e-4 * rows).astype(np.float32)


@pytest.mark.parametrize("quantum", [0.001, 0.004])
def test_depths_are_the_nearest_steps_of_the_sensor(quantum: float) -> None:
    depth = measured(ramp(), SensorNoise(depth_sigma=0.0, depth_quantum=quantum))
    assert np.all(depth % round(1e3 * quantum) == 0)
    assert np.max(np.abs(depth - 1e3 * ramp())) <= 500.0 * quantum + 1e-3


def test_depths_stay_in_the_range_of_an_image() -> None:
    z_buffer = ramp()
    z_buffer[:, 50:] = 80.0
    z_buffer[:24] = 0.021
    depth = measured(z_buffer, SensorNoise(depth_sigma=0.05, edge_mixing=0.0, edge_dropout=0.0))
    assert np.all(depth[30:, 50:] == 65535)
    assert np.mean(depth[:24] == 0) == pytest.approx(0.33, abs=0.03)
    assert np.max(depth[:24]) < 400


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("place", [1, 31, 32, 33])
def test_every_pixel_beside_a_step_is_an_edge(axis: int, place: int) -> None:
    z_buffer = ramp()
    np.moveaxis(z_buffer, axis, 0)[place:] += 0.1
    depth = measured(z_buffer, SensorNoise(depth_sigma=0.0, edge_mixing=0.0, edge_dropout=1.0))
    empty = np.zeros((HEIGHT, WIDTH), bool)
    np.moveaxis(empty, axis, 0)[place - 1 : place + 1] = True
    np.testing.assert_array_equal(depth == 0, empty)


def test_pixels_that_show_nothing_have_no_depth_and_lend_none() -> None:
    z_buffer = ramp()
    z_buffer[10:20, 40:70] = FAR
    depth = measured(z_buffer, SensorNoise(edge_mixing=1.0, edge_dropout=0.0))
    np.testing.assert_array_equal(depth == 0, z_buffer == FAR)
    assert np.max(np.abs(depth - 1e3 * ramp())[z_buffer < FAR]) < 12.0
