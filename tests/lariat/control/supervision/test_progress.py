"""Measures of a run from observations of the rope."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.control.supervision.progress import STUCK_TIME, ProgressMonitor
from lariat.geometry.obstacles import Obstacle

PERIOD = 40_000_000
GOAL = np.stack([np.linspace(-0.2, 0.2, 9), np.zeros(9), np.full(9, 0.3)], axis=1)
POST = Obstacle("sphere", (0.0, 0.1, 0.3), radius=0.02)
BAR = Obstacle("sphere", (0.0, 0.0, 0.27), radius=0.02, support=True)


def monitor() -> ProgressMonitor:
    """Progress of a rope with a radius of 4 mm towards a goal with a tolerance of 3 mm."""
    return ProgressMonitor(0.003, 0.004)


def observe(progress: ProgressMonitor, offsets: list[float], start: int = PERIOD) -> int:
    """Observe the rope off its goal by some distances [m]; time of the last observation [ns]."""
    now = start
    for k, offset in enumerate(offsets):
        now = start + k * PERIOD
        progress.observe(now, GOAL + np.array([0.0, offset, 0.0]), GOAL, ())
    return now


def test_errors_are_mean_and_maximum_of_the_node_distances() -> None:
    progress = monitor()
    nodes = GOAL.copy()
    nodes[4, 2] += 0.09
    progress.observe(PERIOD, nodes, GOAL, ())
    assert progress.error == pytest.approx(0.01)
    assert progress.max_node_error == pytest.approx(0.09)


def test_rope_has_settled_after_resting_within_tolerance_for_the_settling_time() -> None:
    progress = monitor()
    assert not progress.settled(observe(progress, [0.002] * 7))
    assert progress.settled(observe(progress, [0.002] * 2, 8 * PERIOD))


def test_one_observation_beyond_the_tolerance_delays_settling() -> None:
    progress = monitor()
    now = observe(progress, [0.0029] * 6 + [0.0031] + [0.0029] * 3)
    assert progress.resting(now)
    assert not progress.settled(now)
    assert progress.settled(observe(progress, [0.0029] * 8, now + PERIOD))


@pytest.mark.parametrize(("speed", "rests"), [(0.008, True), (0.012, False)])
def test_rope_rests_below_the_rest_speed(speed: float, rests: bool) -> None:
    progress = monitor()
    now = observe(progress, [speed * 0.04 * k for k in range(9)])
    assert progress.resting(now) is rests


def test_rope_is_stuck_when_the_error_falls_by_less_than_the_progress_share() -> None:
    progress = monitor()
    progress.begin(0, 0)
    observe(progress, [0.100, 0.098])
    assert not progress.stuck(PERIOD + STUCK_TIME)
    assert progress.stuck(PERIOD + STUCK_TIME + 1)
    observe(progress, [0.096], 3 * PERIOD)
    assert not progress.stuck(3 * PERIOD + STUCK_TIME)


def test_clearance_is_that_of_the_surfaces_and_leaves_supports_out() -> None:
    progress = monitor()
    progress.observe(10 * PERIOD, GOAL, GOAL, (POST, BAR))
    assert progress.clearance == pytest.approx(0.1 - 0.02 - 0.004)
    progress.observe(11 * PERIOD, GOAL + np.array([0.0, 0.03, 0.0]), GOAL, (POST,))
    assert progress.clearance == pytest.approx(0.076)
    progress.observe(15 * PERIOD, GOAL + np.array([0.0, 0.03, 0.0]), GOAL, (POST,))
    progress.observe(20 * PERIOD, GOAL, GOAL, (POST,))
    assert progress.clearance == pytest.approx(0.076)
    assert progress.min_clearance == pytest.approx(0.046)


def test_clearance_taken_is_the_least_since_it_was_taken_last() -> None:
    progress = monitor()
    near, far = GOAL + np.array([0.0, 0.03, 0.0]), GOAL
    for k, nodes in enumerate((far, near, far), start=1):
        progress.observe(10 * k * PERIOD, nodes, GOAL, (POST,))
    assert progress.take_clearance() == pytest.approx(0.046)
    assert progress.take_clearance() == pytest.approx(0.076)


def test_clearance_is_also_that_between_nodes() -> None:
    progress = monitor()
    # 25 mm from the nodes of an edge along the rope, 11 mm from its middle.
    pin = Obstacle("sphere", (0.025, 0.012, 0.3), radius=0.001)
    progress.observe(10 * PERIOD, GOAL, GOAL, (pin,))
    assert progress.clearance == pytest.approx(0.011 - 0.004, abs=1e-6)
