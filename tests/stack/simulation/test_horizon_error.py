"""Horizons are compared with the true rope while it moves."""

from __future__ import annotations

import numpy as np
import pytest

from shared.messages import Plan
from stack.simulation.horizon_error import HorizonError

NODES = np.stack([np.linspace(0.0, 0.4, 9), np.zeros(9), np.zeros(9)], axis=1)
FRAME = 33_000_000


def horizon_error(speed: float, off: float) -> HorizonError:
    """Of a rope that rises at `speed` [m/s], foreseen `off` [m] beside where it will be."""
    found = HorizonError()
    ahead, count = 50_000_000, 5
    for k in range(30):
        now = k * FRAME
        ends = [now + (j + 1) * ahead for j in range(count)]
        chains = [NODES + np.array([0.0, off, speed * end * 1e-9]) for end in ends]
        found.take_plan(
            Plan(stamp=ends[0], dt=ahead, node_count=9, nodes=np.concatenate(chains).ravel())
        )
        found.take_rope(now, NODES + np.array([0.0, 0.0, speed * now * 1e-9]))
    return found


def test_error_is_the_distance_at_the_end_of_the_horizon() -> None:
    assert horizon_error(0.3, 0.003).error == pytest.approx(0.003, rel=1e-6)


def test_predictions_for_a_rope_at_rest_do_not_count() -> None:
    assert horizon_error(0.0, 0.003).error is None
