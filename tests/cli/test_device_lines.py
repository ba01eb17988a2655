"""What a person reads about the arms."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cli.arm import device_lines
from cli.check import arm_starts
from lariat.arms.cr5_installation import kinematics_of
from lariat.scenario import load
from shared.messages import ArmState, ArmStates

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def test_arm_that_is_not_heard_says_why_and_a_fixed_end_says_nothing() -> None:
    states = ArmStates(
        arms=[
            ArmState(arm="left", driver="fixed"),
            ArmState(arm="right", driver="cr5", alarms=["192.168.5.1:29999: connection refused"]),
        ]
    )
    (line,) = device_lines(states)
    assert line.startswith("right (cr5): ")
    assert "192.168.5.1:29999" in line
    states.arms[1].mode, states.arms[1].link_rate = "idle", 125.0
    states.arms[1].tracking_error = 0.012
    assert all(w in next(device_lines(states)) for w in ("idle", "125 Hz", "12 mm"))


def test_joints_to_jog_to_put_the_grip_at_the_start() -> None:
    cell = load(SCENARIOS / "two-arms.toml")
    starts = arm_starts(cell)
    for side, grip in zip(("left", "right"), cell.grips(cell.start), strict=True):
        kinematics = kinematics_of(cell.end(side))
        flange = kinematics.flange(np.radians(starts[side]))
        reached = kinematics.grip_of_flange(flange)
        np.testing.assert_allclose(reached.position, grip.position, atol=3e-4)
    assert arm_starts(load(SCENARIOS / "three-cylinders.toml")) == {}
