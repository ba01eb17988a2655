"""Measures of a run by the true rope."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared import topics
from shared.messages import RUNNING, Goal, NodeChain, TaskState
from shared.scenario import load
from shared.scenario.sections import Obstacle
from shared.service import SECOND
from stack.simulation.scoring import Scorer
from stack.simulation.simulated_time import Delivery

SCENARIO = load(Path(__file__).parents[3] / "scenarios" / "three-cylinders.toml")
LINE = np.stack([np.linspace(-0.225, 0.225, 4), np.zeros(4), np.full(4, 0.3)], axis=1)
RADIUS = SCENARIO.rope.diameter / 2.0


def scored(*chains: np.ndarray, obstacle: Obstacle) -> Scorer:
    """Score of a run in which the true rope is seen once in 0.1 s."""
    scorer = Scorer(replace(SCENARIO, obstacles=(obstacle,)))

    def hear(topic: topics.Topic, message: NodeChain | TaskState) -> None:
        scorer(Delivery(topic, message.SerializeToString(), "sim", 0, message.stamp))

    hear(
        topics.TASK_STATE,
        TaskState(
            stamp=SECOND, run_started=SECOND, state=RUNNING, goal=Goal(positions=LINE.ravel())
        ),
    )
    for k, nodes in enumerate(chains):
        stamp = SECOND + (k + 1) * SECOND // 10
        hear(topics.ROPE_TRUTH, NodeChain(stamp=stamp, positions=nodes.ravel()))
    return scorer


def test_clearance_and_contact_are_those_of_segments() -> None:
    # Between two nodes that are 75 mm away from its middle.
    pin = Obstacle(name="pin", shape="sphere", position=(0.0, 0.02, 0.3), radius=0.01)
    apart = scored(LINE, obstacle=pin)
    assert apart.min_clearance == pytest.approx(0.01 - RADIUS, abs=1e-6)
    assert apart.contact_time == 0.0
    touching = scored(LINE, LINE + np.array([0.0, 0.008, 0.0]), LINE, obstacle=pin)
    assert touching.min_clearance == pytest.approx(0.002 - RADIUS, abs=1e-6)
    assert touching.contact_time == pytest.approx(0.1)


def test_finer_rope_is_compared_with_the_goal_by_arc_length() -> None:
    fine = np.stack([np.linspace(-0.225, 0.225, 61), np.full(61, 0.004), np.full(61, 0.3)], axis=1)
    far = Obstacle(name="far", shape="sphere", position=(0.0, 0.5, 0.3), radius=0.01)
    _, mean, largest = scored(fine, obstacle=far).errors[-1]
    assert (mean, largest) == pytest.approx((0.004, 0.004))
