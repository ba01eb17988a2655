"""Measured error of predictions."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.control.estimation.prediction_monitor import PredictionMonitor
from lariat.control.estimation.rope_observation import RopeObservation

COUNT, HORIZON, STEP = 20, 5, 50_000_000
LINE = np.stack([np.linspace(-0.2, 0.2, COUNT), *np.zeros((2, COUNT))], axis=1)
VELOCITY = np.array([0.0, 0.2, 0.0])
SEEN = np.ones(COUNT, dtype=bool)


def watched(
    error: float, noise: float = 0.0, observed: np.ndarray = SEEN, seconds: float = 2.0
) -> PredictionMonitor:
    """Monitor of a rope that moves with `VELOCITY`, predicted with an error [m] at 0.25 s."""
    monitor = PredictionMonitor()
    random = np.random.default_rng(0)
    for k in range(round(seconds / 0.02)):
        now = k * 20_000_000
        times = 1e-9 * (now + STEP * np.arange(1, HORIZON + 1))
        nodes = LINE + times[:, None, None] * VELOCITY
        nodes[:, :, 2] += error * (np.arange(1, HORIZON + 1) / HORIZON)[:, None]
        monitor.take_plan(now, STEP, nodes)
        true = LINE + 1e-9 * now * VELOCITY
        noisy = true + noise * random.normal(size=true.shape)
        noisy[~observed] += 0.1
        monitor.observe(RopeObservation(now, noisy, np.full(COUNT, noise), observed))
    return monitor


@pytest.mark.parametrize("noise", [0.0, 0.002])
def test_deviation_is_that_of_the_end_of_the_horizon_without_the_noise(noise: float) -> None:
    # Between two horizons, up to 20 ms of 250 ms before its end.
    assert watched(0.008, noise).deviation == pytest.approx(0.008, rel=0.12)


def test_right_predictions_have_no_deviation_in_spite_of_noise() -> None:
    assert watched(0.0, 0.002).deviation < 1.2e-3


def test_nodes_that_were_not_seen_do_not_count() -> None:
    observed = SEEN.copy()
    observed[5:12] = False
    assert watched(0.008, observed=observed).deviation == pytest.approx(0.008, rel=0.12)


def test_largest_deviation_stays_until_the_next_path() -> None:
    monitor = watched(0.008)
    largest = monitor.max_deviation
    monitor.observe(RopeObservation(2_100_000_000, LINE + 2.1 * VELOCITY, np.zeros(COUNT), SEEN))
    assert monitor.max_deviation >= largest > 0.007
    monitor.begin_path()
    assert (monitor.deviation, monitor.max_deviation) == (0.0, 0.0)


def test_predictions_of_a_motion_that_was_stopped_do_not_count() -> None:
    monitor = watched(0.0)
    monitor.drop_predictions()
    monitor.observe(RopeObservation(2_000_000_000, LINE, np.zeros(COUNT), SEEN))
    assert monitor.deviation < 1e-6
