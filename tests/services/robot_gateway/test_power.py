"""Power of the arms: taken by feedback, whoever gave it."""

from __future__ import annotations

import pytest

from services.robot_gateway.messages import arm_states
from tests.services.robot_gateway.arm_cell import ArmWorld, circle


def said(world: ArmWorld) -> str:
    return arm_states(world.report, world.cell.arms.drivers, world.now).reason


@pytest.mark.parametrize("firmware", ["v3", "v4"])
def test_next_gateway_stops_and_disables_what_the_former_one_left_on(firmware: str) -> None:
    world = ArmWorld(firmware)
    world.until_ready()
    since = world.now
    world.follow(circle(world.cell.follower.state.positions[0], 0.06, 0.12), 0.9, since)
    assert world.emulator.controller.enabled
    # The gateway dies, its connections end, and another one connects.
    world.cell.close()
    world.start_gateway()
    world.step()
    assert world.emulator.controller.enabled
    assert world.mode == "disarmed"
    assert "still powered: right" in said(world)
    world.run(1.0)
    assert not world.emulator.controller.enabled
    assert "still powered" not in said(world)
    assert world.joint_speeds[-1][1] < 1e-3


def test_disarming_disables_an_arm_that_somebody_else_has_enabled() -> None:
    world = ArmWorld("v3", automatic=False)
    world.run(0.3)
    assert not world.report.arms[1].powered
    world.emulator.controller.enable()
    world.run(1.2)
    assert world.emulator.controller.enabled, "only reported: it may be jogged"
    assert "still powered: right" in said(world)
    assert world.command("disarm") == ""
    world.run(0.5)
    assert not world.emulator.controller.enabled
    assert "still powered" not in said(world)


def test_power_of_an_arm_that_is_not_heard_counts_as_on() -> None:
    world = ArmWorld("v3", automatic=False)
    world.run(0.3)
    world.emulator.inject("frozen")
    world.run(0.3)
    assert "still powered: right, not heard" in said(world)
    world.emulator.controller.enable()
    world.emulator.heal("frozen")
    # Nobody knows who enabled it meanwhile.
    for _ in range(800):
        if not world.emulator.controller.enabled:
            break
        world.step()
    assert not world.emulator.controller.enabled


def test_disabling_is_tried_again_until_the_drives_are_off() -> None:
    world = ArmWorld("v4")
    world.until_ready()
    controller = world.emulator.controller
    disable, tries = controller.disable, []

    def stubborn() -> None:
        tries.append(world.seconds)
        if len(tries) > 2:
            disable()

    controller.disable = stubborn
    assert world.command("disarm") == ""
    world.run(1.0)
    assert "still powered: right" in said(world)
    world.run(1.5)
    assert len(tries) == 3
    assert not controller.enabled
    assert "still powered" not in said(world)
