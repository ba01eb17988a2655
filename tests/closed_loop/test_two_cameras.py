"""A run in which each of two cameras sees what an obstacle hides from the other."""

from __future__ import annotations

import numpy as np

from lariat.scenario.settings import load_with
from shared import topics
from stack.simulation import closed_loop
from stack.simulation.simulated_time import Delivery
from tests.closed_loop.loop import SCENARIOS


def test_the_rope_reaches_its_goal_below_a_shelf_that_hides_it_from_above() -> None:
    shares: list[float] = []

    def watch(delivery: Delivery) -> None:
        if delivery.key == topics.ROPE_NODES.key:
            shares.append(float(np.mean(delivery.parse().observed or [False])))

    scenario = load_with(SCENARIOS / "two-cameras.toml", ())
    score = closed_loop.run(scenario, stop_after=0.3, taps=(watch,)).score
    assert score.reached
    assert score.final_error_mm is not None
    assert score.final_error_mm < 1.0
    assert score.min_clearance_mm is not None
    assert score.min_clearance_mm > 8.0
    assert np.mean(shares) > 0.95
