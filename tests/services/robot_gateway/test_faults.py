"""Every fault of the arm in the middle of a motion: what stops, by which name, and what follows."""

from __future__ import annotations

from copy import deepcopy
from functools import cache

import numpy as np
import pytest

from services.cr5_emulator.commands.dispatch import CommandDispatcher
from tests.services.robot_gateway.arm_cell import ArmWorld, circle

# What the table says of each: the cause that is named, and words that a person reads.
STOPPING = {
    "alarm_singular": ("alarm", "wrist singularity"),
    "alarm_overspeed": ("alarm", "joint 2 is too fast"),
    "collision": ("alarm", "collision"),
    "emergency_stop": ("alarm", "emergency stop"),
    "power_off": ("alarm", "no power"),
    "drag": ("alarm", "guided by hand"),
    "taken_over": ("alarm", "not TCP"),
    "queue_blocked": ("alarm", "motion queue is blocked"),
    "stale_feedback": ("lost_link", "no feedback on port 30004"),
    "wrong_test_value": ("lost_link", "the data is no packet"),
    "wrong_size": ("lost_link", "the data is no packet"),
    "links_closed": ("lost_link", "closed"),
    "frozen": ("lost_link", "no feedback"),
    "repeated_feedback": ("lost_link", "the same packet repeats"),
}
SAME_ON_V4 = ("wrong_test_value", "wrong_size", "repeated_feedback")
"""The packets are."""
HARMLESS = [
    "slow_feedback",
    "no_servo_reply",
    "torn_replies",
    "joined_replies",
    "torn_feedback",
    "idle_close",
]


def moving(firmware: str, **options: object) -> tuple[ArmWorld, int]:
    """A world in the middle of a circle, and since when."""
    world, since = deepcopy(_moving(firmware, **options))
    # Its table holds functions of the arm that was copied.
    world.emulator.commands = CommandDispatcher(world.emulator.controller)
    return world, since


@cache
def _moving(firmware: str, **options: object) -> tuple[ArmWorld, int]:
    world = ArmWorld(firmware, **options)
    world.until_ready()
    since = world.now
    world.path = circle(world.cell.follower.state.positions[0], 0.06, 0.12)  # pyright: ignore[reportAttributeAccessIssue]
    world.follow(world.path, 0.9, since)  # pyright: ignore[reportAttributeAccessIssue]
    assert world.mode == "moving", world.report
    return world, since


def slowed_after(world: ArmWorld, begun: float) -> float:
    """Time from `begun` until the joints are slower than they were, and stay so [s]."""
    t, speed = np.array(world.joint_speeds).T
    level = speed[t <= begun][-1]
    later = t > begun
    fast = later & (speed > 0.98 * level)
    return float(t[fast][-1] - begun) if np.any(fast) else 0.0


@pytest.mark.parametrize(
    ("fault", "firmware"),
    [(f, v) for f in STOPPING for v in ("v3", "v4") if v == "v3" or f not in SAME_ON_V4],
)
def test_fault_brakes_within_150_ms_is_named_and_waits_for_a_person(
    fault: str, firmware: str
) -> None:
    cause, words = STOPPING[fault]
    world, since = moving(firmware)
    begun = world.seconds
    world.emulator.inject(fault)
    world.follow(world.path, 0.5, since)  # pyright: ignore[reportAttributeAccessIssue]
    assert (world.mode, world.report.safety.cause) == ("fault", cause), world.report
    assert world.report.safety.needs_acknowledgement
    said = f"{world.report.safety.detail} {world.report.arms[1].alarms}"
    assert words in said
    # An arm that heard the last point finishes it, within the servo's own time.
    assert slowed_after(world, begun) <= 0.15 + (0.1 if cause == "lost_link" else 0.0)
    assert world.joint_speeds[-1][1] < 0.02, "at rest half a second later"
    # Nothing moves before a person acknowledges, whatever the writer says.
    world.emulator.heal(fault)
    world.emulator.controller.dragging = False
    world.emulator.controller.pressed = False
    rest = world.emulator.controller.joints.copy()
    world.follow(world.path, 0.3, since)  # pyright: ignore[reportAttributeAccessIssue]
    assert world.mode == "fault"
    # One point may have been under way to an arm that did not listen for a while.
    under_way = 0.02 if fault == "frozen" else 1e-3
    np.testing.assert_allclose(world.emulator.controller.joints, rest, atol=under_way)
    # And then work goes on, from where the arm is.
    world.go_on()
    here = world.cell.follower.state.positions[0]
    np.testing.assert_allclose(here, world.measured[-1], atol=1e-4)
    world.follow(circle(here, 0.05, 0.1), 0.7)
    assert world.mode == "moving", world.report
    assert np.linalg.norm(world.measured[-1] - here) > 0.01


@pytest.mark.parametrize("fault", HARMLESS)
def test_harmless_fault_of_the_line_stops_nothing(fault: str) -> None:
    world, since = moving("v3", faults=(fault,))
    world.follow(world.path, 1.0, since)  # pyright: ignore[reportAttributeAccessIssue]
    assert world.mode == "moving", world.report
    assert world.report.arms[1].alarms == ()


def test_arm_that_answers_no_request_is_lost_within_seconds() -> None:
    world, since = moving("v3")
    world.emulator.inject("no_reply")
    world.follow(world.path, 3.5, since)  # pyright: ignore[reportAttributeAccessIssue]
    assert (world.mode, world.report.safety.cause) == ("fault", "lost_link"), world.report
    assert "RobotMode() was not answered within 2 s" in world.report.safety.detail


def test_clock_of_the_arm_may_jump() -> None:
    world, since = moving("v3")
    world.emulator.inject("time_back")
    world.run(0.0)
    world.follow(world.path, 0.06, since)  # pyright: ignore[reportAttributeAccessIssue]
    world.emulator.heal("time_back")
    world.follow(world.path, 0.5, since)  # pyright: ignore[reportAttributeAccessIssue]
    assert world.mode == "moving", world.report


@pytest.mark.parametrize("firmware", ["v3", "v4"])
def test_arm_that_is_pushed_away_while_it_holds_does_not_jump_back(firmware: str) -> None:
    world, _ = moving(firmware)
    world.command("hold")
    world.run(0.6)
    controller = world.emulator.controller
    begun = controller.joints.copy()
    for k in range(25):
        # By something that is stronger than its drives.
        controller.target = begun + 0.006 * (k + 1) * np.eye(6)[0]
        controller.joints = controller.target.copy()
        world.run(0.008)
    pushed = controller.joints.copy()
    world.run(0.5)
    np.testing.assert_allclose(controller.joints, pushed, atol=1e-3)
    assert world.report.tracking[1][0] > 0.08
    world.go_on()
    np.testing.assert_allclose(controller.joints, pushed, atol=1e-3)
    world.follow(circle(world.cell.follower.state.positions[0], 0.05, 0.1), 0.5)
    assert world.mode == "moving", world.report


@pytest.mark.parametrize("silence", ["hold", "coast", "alarm"])
def test_writer_that_dies_leaves_the_arm_at_rest_whatever_it_does_in_silence(silence: str) -> None:
    world, _ = moving("v4", silence=silence)
    begun = world.seconds
    world.run(1.0)
    assert world.report.safety.cause in ("silence", "alarm")
    assert world.report.safety.needs_acknowledgement
    t, speed = np.array(world.joint_speeds).T
    # 150 ms, v / a + a / j of the command, and the lag of the drives.
    bound = begun + 0.15 + 0.12 / 2.0 + 2.0 / 40.0 + 0.25
    assert np.max(speed[t > bound]) < 0.02


def test_arm_not_in_tcp_mode_is_reported() -> None:
    world = ArmWorld("v3", automatic=False, faults=("not_tcp",))
    world.run(0.3)
    world.command("arm")
    world.run(1.0)
    assert world.mode == "fault"
    assert "not TCP" in " ".join(world.report.arms[1].alarms)


def test_port_held_by_another_program_is_reported() -> None:
    world = ArmWorld("v3", automatic=False, faults=("port_taken",))
    world.run(1.0)
    assert "no other program" in " ".join(world.report.arms[1].alarms)
    assert "no other program" in world.command("arm")
    assert world.mode == "disarmed"


def test_late_reply_never_counts_for_another_request() -> None:
    world = ArmWorld("v3", automatic=False, faults=("late_reply",))
    world.run(0.5)
    world.command("arm")
    world.run(16.0)
    assert world.emulator.controller.enabled
    assert world.mode == "armed"


def test_queue_that_is_blocked_before_arming_is_freed_by_it() -> None:
    world = ArmWorld("v3", faults=("queue_blocked",))
    world.until_ready()
    assert world.emulator.controller.queue_running


def test_gateway_that_was_stopped_for_a_while_waits_for_a_person() -> None:
    world, since = moving("v3")
    for _ in range(60):
        # SIGSTOP: the arm's time goes on, the gateway's does not.
        world.now += 8_000_000
        world.emulator.advance_to(world.now * 1e-9)
    world.follow(world.path, 0.3, since)  # pyright: ignore[reportAttributeAccessIssue]
    assert world.report.safety.needs_acknowledgement
    assert world.report.safety.cause in ("stalled", "lost_link"), world.report
    assert np.max(np.abs(world.emulator.controller.joint_speed)) < 0.02


@pytest.mark.parametrize(("firmware", "gap"), [("v3", 0.13), ("v4", 2.0)])
def test_a_simulated_cell_goes_on_by_itself_after_its_gateway_was_too_slow(
    firmware: str, gap: float
) -> None:
    world, since = moving(firmware, simulated=True)
    for _ in range(round(gap / 0.008)):
        world.now += 8_000_000
        world.emulator.advance_to(world.now * 1e-9)
    world.step()
    assert world.report.safety.cause == "slow"
    assert not world.report.safety.needs_acknowledgement
    for _ in range(400):
        world.step()
    here = world.cell.follower.state.positions[0]
    world.path = circle(here, 0.06, 0.12)  # pyright: ignore[reportAttributeAccessIssue]
    since = world.now
    world.follow(world.path, 0.6, since)  # pyright: ignore[reportAttributeAccessIssue]
    assert world.mode == "moving", world.report


@pytest.mark.parametrize("firmware", ["v3", "v4"])
def test_gateway_that_dies_leaves_no_more_than_one_point_to_the_arm(firmware: str) -> None:
    world, _ = moving(firmware)
    before = world.emulator.controller.joints.copy()
    speed = np.max(np.abs(world.emulator.controller.joint_speed))
    speeds = []
    for _ in range(125):
        world.now += 8_000_000
        world.emulator.advance_to(world.now * 1e-9)
        speeds.append(np.max(np.abs(world.emulator.controller.joint_speed)))
    # The servo time of V3's point is 0.1 s, and the drives lag.
    assert max(speeds[40:]) < 0.01
    assert np.max(np.abs(world.emulator.controller.joints - before)) < 0.25 * speed + 0.01


def test_writer_that_held_while_the_gateway_stood_still_does_not_hide_that() -> None:
    world, since = moving("v3")
    for _ in range(60):
        world.now += 8_000_000
        world.emulator.advance_to(world.now * 1e-9)
    # What waited for the gateway comes first: chunks, and a hold that needs nobody.
    world.cell.stop_if_stalled(world.now)
    world.cell.take_hold("writer", world._sequence, world.now, "waiting for a path")
    world._sequence += 1
    rest = world.emulator.controller.joints.copy()
    world.follow(world.path, 0.5, since)  # pyright: ignore[reportAttributeAccessIssue]
    assert world.report.safety.needs_acknowledgement
    np.testing.assert_allclose(world.emulator.controller.joints, rest, atol=2e-3)


def goes_on(world: ArmWorld) -> bool:
    """Whether the arm follows new setpoints within 5 s, without a person."""
    world.run(5.0)
    path = circle(world.cell.follower.state.positions[0], 0.06, 0.12)
    world.follow(path, 0.6, world.now)
    return world.mode == "moving"


@pytest.mark.parametrize("firmware", ["v3", "v4"])
def test_a_simulated_cell_goes_on_by_itself_after_its_emulator_was_too_slow(
    firmware: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    world, since = moving(firmware, simulated=True)
    advance = world.emulator.advance_to
    monkeypatch.setattr(world.emulator, "advance_to", lambda seconds: None)
    world.follow(world.path, 0.3, since)  # pyright: ignore[reportAttributeAccessIssue]
    assert world.report.safety.cause == "slow", world.report
    assert not world.report.safety.needs_acknowledgement
    monkeypatch.setattr(world.emulator, "advance_to", advance)
    assert goes_on(world), world.report
    assert world.report.pauses == 1


def test_a_simulated_arm_that_is_heard_again_while_disarmed_gets_no_power(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    world, since = moving("v3", simulated=True)
    advance = world.emulator.advance_to
    monkeypatch.setattr(world.emulator, "advance_to", lambda seconds: None)
    world.follow(world.path, 0.3, since)  # pyright: ignore[reportAttributeAccessIssue]
    assert world.command("disarm") == ""
    monkeypatch.setattr(world.emulator, "advance_to", advance)
    world.run(5.0)
    assert world.mode == "disarmed"
    assert not world.emulator.controller.enabled


@pytest.mark.parametrize("late", [True, False])
def test_a_simulated_arm_off_its_path_goes_on_by_itself_only_after_a_gap(late: bool) -> None:
    world, since = moving("v3", simulated=True)
    if late:
        # Shorter than what counts as a lost link, longer than what a computer that keeps up needs.
        world.now += 60_000_000
        world.emulator.advance_to(world.now * 1e-9)
        world.follow(world.path, 0.1, since)  # pyright: ignore[reportAttributeAccessIssue]
    world.driver.tracking_limit = 1e-5
    world.step()
    safety = world.report.safety
    assert safety.cause == ("slow" if late else "tracking"), world.report
    assert safety.needs_acknowledgement is not late
    world.driver.tracking_limit = 0.02
    assert goes_on(world) is late, world.report
