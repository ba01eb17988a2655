"""Both ends of one rope on CR5s, in one gateway, each behind its own emulated line."""

from __future__ import annotations

import numpy as np

from lariat.scenario import SIDES
from lariat.scenario.settings import load_with
from shared import topics
from shared.messages import ArmStates
from stack.simulation import closed_loop
from stack.simulation.simulated_time import Delivery
from tests.closed_loop.loop import SCENARIOS


def test_two_arms_bring_the_rope_to_its_goal_together():
    moving: dict[str, set[int]] = {side: set() for side in SIDES}

    def tap(delivery: Delivery) -> None:
        if delivery.key == topics.ARM_STATE.key:
            state: ArmStates = delivery.parse()
            for arm in state.arms:
                if np.linalg.norm(arm.linear_velocity) > 0.02:
                    moving[arm.arm].add(state.stamp)

    settings = ("run.time_limit=4.0", "sensing.source=truth")
    cell = load_with(SCENARIOS / "two-arms.toml", settings)
    outcome = closed_loop.run(cell, stop_after=0.5, taps=(tap,))
    score = outcome.score
    assert score.reached, outcome.reason
    assert score.final_error_mm is not None
    assert score.final_error_mm < 0.5
    assert score.length_error_mm < 1.0
    assert score.min_clearance_mm is not None
    assert score.min_clearance_mm > 5.0
    arms = outcome.stack.latest(topics.ARM_STATE)
    assert arms is not None
    assert arms.cause == ""
    assert [(a.arm, a.driver, len(a.joints)) for a in arms.arms] == [
        ("left", "cr5", 6),
        ("right", "cr5", 6),
    ]
    left, right = moving["left"], moving["right"]
    assert len(left) > 100
    assert len(left & right) > 0.9 * len(left | right)


def test_arms_that_rotate_the_ends_come_to_rest_at_the_goal() -> None:
    settings = (
        "ends.left.rotates=true",
        "ends.right.rotates=true",
        # Turned by 0.6 rad about the vertical, inwards and outwards.
        "goal.left_orientation=[0.33, 0.33, 0.6255, 0.6255]",
        "goal.right_orientation=[0.6255, 0.6255, 0.33, 0.33]",
        "plant.model=mujoco",
        "run.time_limit=5.0",
        "sensing.source=truth",
    )
    outcome = closed_loop.run(load_with(SCENARIOS / "two-arms.toml", settings))
    assert outcome.score.reached, outcome.reason
    late = outcome.nodes[outcome.times > 4.0]
    swing = np.linalg.norm(late - late.mean(axis=0), axis=2)
    assert swing.max() < 1e-3
