"""What an arm measures keeps the rules too, not only what it is commanded to do."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from lariat.geometry.obstacles import TABLE, Obstacle
from tests.services.robot_gateway.arm_cell import GRIPS, ArmWorld
from tests.services.robot_gateway.test_faults import moving

HERE = GRIPS[1].position


def displace(world: ArmWorld, joint: int, angle: Callable[[float], float]) -> None:
    """Let the drives of one joint go elsewhere, by an angle of the time from now on [rad, s]."""
    controller, begun = world.emulator.controller, world.seconds
    follow_point = controller.follow_point

    def off(target: np.ndarray, *arguments: float) -> None:
        follow_point(target + angle(world.seconds - begun) * np.eye(6)[joint], *arguments)

    controller.follow_point = off  # pyright: ignore[reportAttributeAccessIssue]


def rest(world: ArmWorld, seconds: float) -> None:
    world.follow(lambda t: HERE, seconds)


def test_arm_that_turns_away_from_its_command_holds() -> None:
    world = ArmWorld("v3")
    world.until_ready()
    # The last joint turns the gripper in place, up to a right angle.
    displace(world, 5, lambda t: min(1.0 * t, np.pi / 2.0))
    rest(world, 1.0)
    assert world.report.safety.cause == "tracking", world.report
    assert "rad off its command" in world.report.safety.detail
    assert world.report.tracking[1][0] < 0.01
    turned = world.report.tracking[1][1]
    # It is led no further; what it follows meanwhile is on its way.
    assert 0.15 < turned < 0.4


def test_arm_that_follows_too_late_holds() -> None:
    world, since = moving("v4")
    controller = world.emulator.controller
    follow_point, waiting = controller.follow_point, []

    def late(*arguments: object) -> None:
        waiting.append((world.seconds, arguments))
        while waiting and world.seconds - waiting[0][0] >= 0.6:
            follow_point(*waiting.pop(0)[1])

    controller.follow_point = late  # pyright: ignore[reportAttributeAccessIssue]
    world.follow(world.path, 1.2, since)  # pyright: ignore[reportAttributeAccessIssue]
    assert world.report.safety.cause == "tracking", world.report


@pytest.mark.parametrize(
    ("rule", "obstacle"),
    [
        ("keep_out", Obstacle("box", (0.12, -0.174, 0.28), size=(0.05, 0.1, 0.05), name="post")),
        ("table", Obstacle("half_space", (0.0, -0.119, 0.0), normal=(0.0, 1.0, 0.0))),
    ],
)
def test_arm_beside_its_path_does_not_enter_what_its_command_keeps_out_of(
    rule: str, obstacle: Obstacle
) -> None:
    world = ArmWorld("v4")
    world.cell.take_scene([TABLE, obstacle])
    world.until_ready()
    rest(world, 0.3)
    assert world.report.safety.may_move, "the command keeps the rule"
    # Towards the obstacle by up to 18 mm, which is no tracking fault.
    displace(world, 0, lambda t: min(0.03 * t, 0.03))
    for _ in range(75):
        rest(world, 0.02)
        if world.report.safety.needs_acknowledgement:
            break
    assert (world.report.safety.cause, world.report.rule) == ("measured", rule), world.report
    assert world.report.tracking[1][0] < 0.012
    # A person may go on from there, but not further in.
    del world.emulator.controller.follow_point
    world.go_on()
    held = world.measured[-1]
    world.follow(lambda t: held + np.array([0.0, 0.01 * t, 0.0]), 0.5)
    assert world.mode == "moving", world.report
    np.testing.assert_allclose(world.measured[-1][1] - held[1], 0.005, atol=2e-3)


def test_joint_beyond_its_limit_holds_although_its_command_keeps_it() -> None:
    world = ArmWorld("v4")
    world.until_ready()
    rest(world, 0.3)
    constraints = world.driver.joint_constraints
    assert constraints is not None
    limits = constraints.kinematics.joint_range
    measured = abs(world.report.arms[1].joints[0])
    displace(world, 0, lambda t: min(0.03 * t, 0.03) * np.sign(world.report.arms[1].joints[0]))
    before = limits.copy()
    limits[:, 0] = [-measured - 0.003, measured + 0.003]
    try:
        rest(world, 1.2)
    finally:
        limits[:] = before
    found = (world.report.safety.cause, world.report.rule)
    assert found == ("measured", "joint_limits"), world.report
