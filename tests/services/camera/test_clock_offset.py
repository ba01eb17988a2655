from __future__ import annotations

import numpy as np
import pytest

from services.camera.clock_offset import MAX_DIFFERENCE_AGE, MAX_JUMP, ClockOffset

MS = 1_000_000
OFFSET = 77_000_000_000


def stamps(clock: ClockOffset, drift: float = 0.0, frames: int = 900) -> np.ndarray:
    """Errors of the stamps of 30 s at 30 Hz whose arrival is 12 ms late and jitters [ms]."""
    random = np.random.default_rng(1)
    errors = []
    for k in range(frames):
        true = 1_000_000_000 + k * 33 * MS
        exposed = round((true - OFFSET) * (1.0 + drift))
        arrived = true + 12 * MS + round(random.exponential(4 * MS))
        errors.append((clock.stamp(exposed, arrived) - true) / MS)
    return np.array(errors)


def test_the_offset_is_found_within_a_millisecond_under_jitter() -> None:
    clock = ClockOffset(12 * MS)
    errors = stamps(clock)
    assert np.max(np.abs(errors[100:])) < 1.0
    assert clock.offset == pytest.approx(OFFSET, abs=MS)


def test_a_clock_that_drifts_is_followed() -> None:
    # 50 ppm: half a millisecond in the window.
    errors = stamps(ClockOffset(12 * MS), drift=50e-6)
    assert np.max(np.abs(errors[100:])) < 1.0 + 50e-6 * MAX_DIFFERENCE_AGE / MS


def test_a_restarted_device_gets_a_new_offset_at_once() -> None:
    clock = ClockOffset()
    clock.stamp(5_000 * MS, 9_000 * MS)
    assert clock.stamp(10 * MS, 9_033 * MS) == 9_033 * MS
    assert clock.stamp(43 * MS, 9_070 * MS) == 9_066 * MS
    assert MAX_JUMP < 5_000 * MS


def test_no_exposure_is_stamped_in_the_future() -> None:
    clock = ClockOffset()
    clock.stamp(0, 100 * MS)
    assert clock.stamp(80 * MS, 150 * MS) <= 150 * MS
