"""What is perceived, and horizons, are compared with the true rope while it moves."""

from __future__ import annotations

import numpy as np
import pytest

from shared.messages import Plan
from stack.simulation.rope_errors import HorizonError, SensingError, TrueRope

NODES = np.stack([np.linspace(0.0, 0.4, 9), np.zeros(9), np.zeros(9)], axis=1)
UP = np.array([0.0, 0.0, 1.0])
STEP = 16_000_000
IMAGE = 33_000_000
AGE = 90_000_000


def sensing_error(speed: float, seen: np.ndarray, observed: np.ndarray) -> float | None:
    """Error of a rope that rises at `speed` [m/s], seen displaced by `seen` [m]."""
    found = SensingError()
    for k in range(60):
        found.take_rope(TrueRope(k * STEP, NODES + speed * k * STEP * 1e-9 * UP))
        image = (k * STEP - AGE) // IMAGE * IMAGE
        found.take_seen(image, NODES + speed * image * 1e-9 * UP + seen, observed)
    return found.error


ALL = np.ones(9, dtype=bool)


def test_error_is_the_distance_at_the_time_of_the_image() -> None:
    assert sensing_error(0.3, np.array([0.0, 0.002, 0.0]), ALL) == pytest.approx(0.002, rel=1e-6)


def test_bridged_nodes_do_not_count() -> None:
    off = np.zeros((9, 3))
    off[4:, 1] = 0.01
    assert sensing_error(0.3, off, np.arange(9) < 4) == pytest.approx(0.0, abs=1e-9)


def test_a_rope_at_rest_does_not_count() -> None:
    assert sensing_error(0.0, np.array([0.0, 0.002, 0.0]), ALL) is None


def horizon_error(speed: float, off: float) -> HorizonError:
    """Of a rope that rises at `speed` [m/s], foreseen `off` [m] beside where it will be."""
    found = HorizonError()
    ahead, count = 50_000_000, 5
    for k in range(30):
        now = k * IMAGE
        ends = [now + (j + 1) * ahead for j in range(count)]
        chains = [NODES + np.array([0.0, off, speed * end * 1e-9]) for end in ends]
        found.take_plan(
            Plan(stamp=ends[0], dt=ahead, node_count=9, nodes=np.concatenate(chains).ravel())
        )
        found.take_rope(TrueRope(now, NODES + speed * now * 1e-9 * UP))
    return found


def test_horizon_error_is_the_distance_at_the_end_of_the_horizon() -> None:
    assert horizon_error(0.3, 0.003).error == pytest.approx(0.003, rel=1e-6)


def test_predictions_for_a_rope_at_rest_do_not_count() -> None:
    assert horizon_error(0.0, 0.003).error is None
