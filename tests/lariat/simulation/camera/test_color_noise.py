from __future__ import annotations

import math

import numpy as np
import pytest

from lariat.simulation.camera.color_noise import ColorNoise

SHAPE = (120, 480)


def noise(sigma: float) -> ColorNoise:
    return ColorNoise(sigma, SHAPE[0] * SHAPE[1], np.random.default_rng(0))


def test_noise_has_its_standard_deviation_and_differs_from_frame_to_frame() -> None:
    grey = np.full(SHAPE, 100, np.uint8)
    errors = [noise(3.0).added(grey, frame).astype(float) - 100.0 for frame in (1, 2)]
    for error in errors:
        # Rounding adds 1 / 12.
        assert np.std(error) == pytest.approx(math.hypot(3.0, 1.0 / math.sqrt(12.0)), rel=0.02)
        assert abs(np.mean(error)) < 0.06
    assert abs(np.corrcoef(errors[0].ravel(), errors[1].ravel())[0, 1]) < 0.02
    assert np.all(grey == 100)


@pytest.mark.parametrize("limit", [0, 255])
def test_noise_saturates(limit: int) -> None:
    noisy = noise(3.0).added(np.full(SHAPE, limit, np.uint8), 0)
    error = np.abs(noisy.astype(int) - limit)
    assert 0 < np.max(error) < 30
    assert np.mean(error == 0) == pytest.approx(
        0.5 + 0.5 * math.erf(0.5 / 3.0 / math.sqrt(2)), abs=0.01
    )
