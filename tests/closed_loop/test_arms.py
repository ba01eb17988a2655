"""Simulated arms of other makers reach the goal of a shipped scenario through the gateway."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.scenario.settings import load_with
from shared import topics
from shared.messages import ArmStates
from stack.simulation import closed_loop
from stack.simulation.simulated_time import Delivery
from tests.closed_loop.loop import SCENARIOS
from tests.robots import PANDA, UR5, Robot


@pytest.mark.parametrize("robot", [UR5, PANDA], ids=lambda robot: robot.name)
def test_a_simulated_arm_reaches_the_goal_with_every_rule_in_force(robot: Robot):
    arms: list[ArmStates] = []

    def listen(delivery: Delivery) -> None:
        if delivery.key == topics.ARM_STATE.key:
            arms.append(delivery.parse())

    scenario = load_with(
        SCENARIOS / "fixed-end.toml",
        (*robot.settings("right"), "sensing.source=truth", "plant.model=rod"),
    )
    outcome = closed_loop.run(scenario, stop_after=0.2, taps=(listen,))
    assert outcome.score.reached, outcome.reason
    assert outcome.score.contact_time_s == 0.0
    assert outcome.score.final_error_mm is not None
    assert outcome.score.final_error_mm < 1.0
    moving = [state.arms[1] for state in arms]
    assert moving[-1].driver == "simulated"
    joints = np.array([arm.joints for arm in moving])
    assert joints.shape[1] == robot.joint_count
    speeds = np.abs(np.diff(joints, axis=0)) / 0.008
    assert 0.05 < np.max(speeds) < scenario.limits.joint_speed
