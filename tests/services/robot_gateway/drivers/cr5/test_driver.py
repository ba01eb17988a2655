from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry.poses import Pose
from tests.services.robot_gateway.arm_cell import GRIPS, ArmWorld, circle, off_path


def streamed(firmware: str, seconds: float, **options: object) -> tuple[ArmWorld, float]:
    """A world that went round a circle at 0.1 m/s, and its greatest cross-track error [m]."""
    world = ArmWorld(firmware, **options)
    world.until_ready()
    begun = len(world.commanded)
    centre = world.cell.follower.state.positions[0]
    world.follow(circle(centre, 0.06, 0.1), seconds)
    assert world.mode == "moving", world.report
    errors = []
    for k in range(begun + 10, len(world.measured), 5):
        path = np.array(world.commanded[max(k - 40, 0) : k + 1])
        errors.append(off_path(world.measured[k], path) if np.ptp(path) > 1e-9 else 0.0)
    return world, max(errors)


@pytest.mark.parametrize("firmware", ["v3", "v4"])
def test_arm_keeps_to_its_path_within_a_millimetre(firmware: str) -> None:
    world, error = streamed(firmware, 4.0)
    assert error < 1e-3
    # It really went there: round the circle's far side.
    assert np.ptp(np.array(world.measured)[:, 1]) > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("firmware", ["v3", "v4"])
def test_arm_keeps_to_its_path_for_a_minute(firmware: str) -> None:
    assert streamed(firmware, 60.0)[1] < 1e-3


@pytest.mark.parametrize("firmware", ["v3", "v4"])
def test_calibrated_arm_is_no_fault_and_keeps_to_its_path(firmware: str) -> None:
    world, error = streamed(firmware, 2.0, calibrated=True)
    assert error < 1e-3
    start = world.measured[20]
    assert 1e-4 < np.linalg.norm(start - GRIPS[1].position) < 2e-3


@pytest.mark.parametrize(("tick", "interval"), [(0.008, 0.032), (0.02, 0.04)])
def test_servo_points_keep_their_pace_where_ticks_are_lost(tick: float, interval: float) -> None:
    world = ArmWorld("v4")
    world.tick = round(1e9 * tick)
    sent: list[float] = []
    follow_point = world.emulator.controller.follow_point

    def logged(*arguments: object) -> None:
        sent.append(world.emulator.now)
        follow_point(*arguments)

    world.emulator.controller.follow_point = logged  # pyright: ignore[reportAttributeAccessIssue]
    world.until_ready()
    world.follow(circle(world.cell.follower.state.positions[0], 0.05, 0.1), 2.0)
    gaps = np.diff(sent[10:])
    assert np.all(np.abs(gaps - interval) < 1e-6)


def test_firmware_that_takes_no_time_for_joints_is_sent_poses() -> None:
    world = ArmWorld("v3")
    table = world.emulator.commands.table
    table["servoj"] = replace(table["servoj"], optional=())
    world.until_ready()
    here = world.cell.follower.state.positions[0]
    world.follow(circle(here, 0.06, 0.1), 2.0)
    assert not world.driver._client.timed_joints
    assert world.mode == "moving"
    assert np.linalg.norm(world.measured[-1] - here) > 0.05


def test_answers_to_servo_points_are_not_needed() -> None:
    assert streamed("v3", 2.0, servo_reply=False)[1] < 1e-3


@pytest.mark.parametrize("firmware", ["v3", "v4"])
def test_gripper_opens_and_closes_at_rest(firmware: str) -> None:
    world = ArmWorld(firmware)
    world.until_ready()
    assert world.command("gripper", arm="right", close=True) == ""
    world.run(0.05)
    assert world.emulator.controller.tool_outputs == [1, 0]
    assert world.command("gripper", arm="right", close=False) == ""
    world.run(0.05)
    assert world.emulator.controller.tool_outputs == [0, 0]
    assert not world.report.arms[1].gripper_closed
    assert "fixed" in world.command("gripper", arm="left", close=True)
    world.follow(circle(world.cell.follower.state.positions[0], 0.05, 0.1), 0.6)
    assert "rest" in world.command("gripper", arm="right", close=True)


def test_arm_has_power_only_while_it_is_armed() -> None:
    world = ArmWorld(automatic=False)
    world.run(0.5)
    assert world.mode == "disarmed"
    assert world.emulator.controller.mode == 4
    assert world.command("arm") == ""
    world.until_ready()
    assert world.emulator.controller.enabled
    assert world.command("disarm") == ""
    world.run(0.3)
    assert (world.mode, world.emulator.controller.mode) == ("disarmed", 4)


@pytest.mark.parametrize("firmware", ["v3", "v4"])
@pytest.mark.parametrize("later", range(3))
def test_power_goes_that_the_arm_has_got_but_not_yet_reported(firmware: str, later: int) -> None:
    world = ArmWorld(firmware, automatic=False)
    world.run(0.5)
    assert world.command("arm") == ""
    while not world.emulator.controller.enabled:
        world.step()
        assert world.cell.arms.powered, "an orderly end would not wait"
    for _ in range(later):
        world.step()
    assert world.command("disarm") == ""
    world.run(0.5)
    assert world.mode == "disarmed"
    assert not world.emulator.controller.enabled


@pytest.mark.parametrize("firmware", ["v3", "v4"])
def test_power_goes_when_the_arm_rests_and_not_already_when_its_command_does(firmware: str) -> None:
    world = ArmWorld(firmware, automatic=False)
    world.run(0.5)
    assert world.command("arm") == ""
    world.until_ready()
    world.follow(circle(world.cell.follower.state.positions[0], 0.06, 0.15), 0.9)
    assert world.joint_speeds[-1][1] > 0.1
    assert world.command("disarm") == ""
    rested = None
    while world.emulator.controller.enabled:
        world.step()
        if rested is None and world.cell.follower.resting:
            rested = world.now
            assert world.joint_speeds[-1][1] > 0.1, "the arm does not lag: nothing is tested"
    assert world.joint_speeds[-1][1] < 0.05
    assert rested is not None
    assert (world.now - rested) * 1e-9 < 0.3


def test_path_through_a_singularity_or_past_a_joint_limit_is_refused() -> None:
    world = ArmWorld()
    world.until_ready()
    here = world.cell.follower.state.positions[0]
    world.follow(lambda t: here + np.array([-0.1 * t, 0.0, 0.15 * t]), 6.0)
    assert world.report.rule in ("singularity", "joint_limits", "joint_speed")
    assert world.report.arms[1].alarms == ()
    assert world.emulator.controller.alarms == []


def test_reset_puts_the_emulated_arm_back() -> None:
    world = ArmWorld("v4")
    world.until_ready()
    world.follow(circle(world.cell.follower.state.positions[0], 0.05, 0.1), 1.5)
    world.cell.take_reset(1)
    world.cell.take_reset(2)
    while world.report.reset_count != 2:
        world.step()
    # The rope is put back at this message, so it must not be led back to where the arm was.
    pose = world.report.arms[1].pose
    assert pose is not None
    np.testing.assert_allclose(pose.position, GRIPS[1].position, atol=1e-6)
    world.run(0.8)
    assert world.report.reset_count == 2
    np.testing.assert_allclose(world.measured[-1], GRIPS[1].position, atol=1e-6)
    assert world.mode == "armed"


def test_arm_away_from_the_start_is_not_armed_but_goes_there_slowly_by_an_approach() -> None:
    away = Pose(GRIPS[1].position + np.array([0.02, 0.06, 0.04]), GRIPS[1].orientation)
    world = ArmWorld("v4", automatic=False, begin=away)
    world.run(0.3)
    answer = world.command("arm")
    assert "75 mm" in answer
    assert "by an approach" in answer
    assert world.mode == "disarmed"
    assert world.approach() == ""
    # A writer that is already there waits, and says so as long as it has nothing to do.
    for k in range(125):
        if k % 3 == 0:
            world.cell.take_hold("writer", world._sequence, world.now, "no task")
            world._sequence += 1
        world.step()
    assert world.mode == "moving"
    world.follow(lambda t: GRIPS[1].position, 3.0)
    np.testing.assert_allclose(world.measured[-1], GRIPS[1].position, atol=1e-3)
    speeds = np.linalg.norm(np.diff(np.array(world.commanded)[60:], axis=0), axis=1) / 0.008
    assert 0.04 < np.max(speeds) <= 0.0505
    assert world.mode in ("armed", "moving")


def test_slow_approach_is_slower_still_where_the_limits_are() -> None:
    away = Pose(GRIPS[1].position + np.array([0.0, 0.03, 0.0]), GRIPS[1].orientation)
    world = ArmWorld("v3", automatic=False, begin=away)
    assert world.driver.joint_constraints is not None
    world.driver.joint_constraints.joint_speed = 0.04
    world.run(0.3)
    assert world.approach() == ""
    world.run(6.0)
    np.testing.assert_allclose(world.measured[-1], GRIPS[1].position, atol=1e-3)
    assert 0.02 < max(speed for _, speed in world.joint_speeds) < 0.045


@pytest.mark.parametrize(("firmware", "alarm"), [("v3", 16), ("v4", 16), ("v3", 117)])
def test_arm_recovers_from_its_alarms_when_a_person_acknowledges(firmware: str, alarm: int) -> None:
    world = ArmWorld(firmware)
    world.until_ready()
    here = world.cell.follower.state.positions[0]
    world.follow(circle(here, 0.06, 0.1), 0.9)
    world.emulator.controller.alarm(alarm)
    world.run(0.5)
    assert (world.mode, world.report.safety.cause) == ("fault", "alarm")
    # V3 has its own number for a collision.
    number = -2 if (alarm, firmware) == (117, "v3") else alarm
    assert f"alarm {number}: " in world.report.arms[1].alarms[0]
    rest = world.emulator.controller.joints.copy()
    world.run(0.5)
    np.testing.assert_allclose(world.emulator.controller.joints, rest, atol=1e-4)
    world.go_on()
    assert world.emulator.controller.alarms == []
    here = world.cell.follower.state.positions[0]
    world.follow(circle(here, 0.05, 0.1), 0.9)
    assert world.mode == "moving", world.report
    assert np.linalg.norm(world.measured[-1] - here) > 0.01


@pytest.mark.parametrize("firmware", ["v3", "v4"])
def test_a_million_random_bytes_on_every_port_hold_the_arm_and_crash_nothing(firmware: str) -> None:
    world = ArmWorld(firmware)
    world.until_ready()
    since = world.now
    path = circle(world.cell.follower.state.positions[0], 0.06, 0.1)
    world.follow(path, 0.9, since)
    rng = np.random.default_rng(3)
    for _ in range(20):
        for connection in world.emulator._connections:
            connection.write(rng.bytes(50_000))
        world.follow(path, 0.016, since)
    world.follow(path, 1.0, since)
    # Packets between the rubbish are found; where none was for long, a person is asked.
    if world.mode == "fault":
        assert world.report.safety.cause == "lost_link"
        world.go_on()
    here = world.cell.follower.state.positions[0]
    world.follow(circle(here, 0.05, 0.1), 0.9, session="after")
    assert world.report.arms[1].alarms == ()


def test_time_that_planning_the_slow_approach_takes_is_no_stall() -> None:
    away = Pose(GRIPS[1].position + np.array([0.0, 0.03, 0.0]), GRIPS[1].orientation)
    world = ArmWorld("v3", automatic=False, begin=away)
    world.run(0.3)
    assert world.approach() == ""
    check = world.cell.follower.check

    def slow(*arguments):  # as the follower's
        world.now += 150_000_000
        return check(*arguments)

    world.cell.follower.check = slow  # pyright: ignore[reportAttributeAccessIssue]
    world.run(4.0)
    assert world.mode == "armed", world.report.safety
    np.testing.assert_allclose(world.measured[-1], GRIPS[1].position, atol=1e-3)
