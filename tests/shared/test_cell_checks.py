"""Checks of a running cell, from messages as its processes publish them."""

from __future__ import annotations

import pytest

from lariat.scenario import Scenario
from lariat.scenario.settings import load_with
from lariat.trajectory import SECOND
from shared.cell_checks import REQUIRED_SERVICES, CellChecks, CheckResult
from shared.messages import REACHED, ArmState, ArmStates, Health, NodeChain, TaskState
from shared.version import version
from tests.closed_loop.loop import SCENARIOS

SLOW = ("limits.speed=0.05", "limits.angular_speed=0.2", "limits.joint_speed=0.5")
REAL = (*SLOW, "ends.right.address=192.0.2.7")


def cell(*settings: str) -> Scenario:
    return load_with(SCENARIOS / "fixed-end.toml", settings)


def arms(mode: ArmStates.Mode = ArmStates.ARMED, speed: float = 0.0, **fields: object) -> ArmStates:
    right = {"driver": "cr5", "position": [0.0, 0.0, 0.3], "link_rate": 125.0, "powered": True}
    state = ArmStates(mode=mode, arms=[ArmState(arm="right", **{**right, **fields})])  # pyright: ignore
    state.arms[0].linear_velocity[:] = [speed, 0.0, 0.0]
    return state


def running(scenario: Scenario, note: str = "") -> CellChecks:
    checks = CellChecks(scenario)
    for name in REQUIRED_SERVICES:
        checks.take_health(name, Health(version=version(), note=note))
    return checks


def of(checks: CellChecks, title: str) -> CheckResult:
    (result,) = [result for result in checks.results() if result.title == title]
    return result


def test_a_stack_that_does_not_run_fails_by_name() -> None:
    found = of(CellChecks(cell()), "Processes and versions")
    assert (found.outcome, found.detail.split()[0]) == ("failed", "perception")
    assert of(CellChecks(cell()), "Arms answer").outcome == "failed"


def test_another_version_and_a_noted_problem_fail() -> None:
    checks = running(cell(), note="waiting for the grips")
    assert of(checks, "Processes and versions").outcome == "failed"
    away = arms()
    away.needs_approach = True
    checks.take_arms(away)
    assert of(checks, "Processes and versions").outcome == "passed"
    checks.take_health("planner", Health(version="0.0.0"))
    assert "planner is version 0.0.0" in of(checks, "Processes and versions").detail


def test_a_fast_cell_is_told_the_limits_of_a_first_day() -> None:
    assert of(CellChecks(cell(*SLOW)), "Limits of a first day").outcome == "passed"
    found = of(CellChecks(cell("limits.speed=0.3")), "Limits of a first day")
    assert (found.outcome, "speed = 0.05" in found.detail) == ("open", True)


@pytest.mark.parametrize(
    ("state", "words"),
    [
        (arms(driver="ideal"), "driven as 'ideal', the file says 'cr5'"),
        (arms(alarms=["joint 3 overheats"]), "joint 3 overheats"),
        (arms(position=[]), "its pose is not known"),
        (arms(link_rate=60.0), "feedback at 60 Hz at most, 100 Hz are needed"),
    ],
)
def test_an_arm_that_is_not_in_order_fails_with_its_reason(state: ArmStates, words: str) -> None:
    checks = running(cell(*REAL))
    checks.take_arms(state)
    found = of(checks, "Arms answer")
    assert found.outcome == "failed"
    assert words in found.detail


def test_poses_and_load_of_a_real_arm_are_for_a_person_to_compare() -> None:
    checks = running(cell(*REAL))
    checks.take_arms(arms(link_rate=95.0))
    checks.take_arms(arms(link_rate=124.0))
    assert of(checks, "Arms answer").outcome == "open"
    assert of(checks, "Load and tool").outcome == "open"


def test_the_emergency_stop_is_open_until_a_real_arm_has_reported_it() -> None:
    checks = running(cell(*REAL))
    checks.take_arms(arms())
    assert of(checks, "Emergency stop").outcome == "open"
    checks.take_arms(arms(alarms=["emergency stop"]))
    checks.take_arms(arms())
    assert of(checks, "Emergency stop").outcome == "passed"
    assert "Emergency stop" not in [result.title for result in running(cell()).results()]


def test_a_stop_in_motion_is_measured_from_the_hold_to_rest() -> None:
    for took, outcome in ((0.17, "passed"), (2.0, "failed")):
        checks = running(cell(*SLOW))
        assert of(checks, "Stop in motion").outcome == "open"
        checks.take_arms(arms(ArmStates.MOVING, 0.04))
        for time, speed in ((1.0, 0.04), (1.1, 0.02), (1.0 + took, 0.0)):
            state = arms(ArmStates.HOLDING, speed)
            state.stamp = round(time * SECOND)
            checks.take_arms(state)
        found = of(checks, "Stop in motion")
        assert found.outcome == outcome
        assert f"{took:.2f} s after the hold" in found.detail


def test_a_hold_of_slow_arms_is_no_drill() -> None:
    checks = running(cell(*SLOW))
    checks.take_arms(arms(ArmStates.MOVING, 0.005))
    checks.take_arms(arms(ArmStates.HOLDING, 0.0))
    assert of(checks, "Stop in motion").outcome == "open"


def test_a_run_counts_once_it_has_reached_its_goal() -> None:
    checks = running(cell())
    assert of(checks, "Run to the goal").outcome == "open"
    checks.take_task(TaskState(state=REACHED))
    checks.take_task(TaskState())
    assert of(checks, "Run to the goal").outcome == "passed"


def test_power_must_be_off_when_disarmed() -> None:
    checks = running(cell())
    for state, outcome in (
        (arms(), "open"),
        (arms(ArmStates.DISARMED), "failed"),
        (arms(ArmStates.DISARMED, powered=False), "passed"),
    ):
        checks.take_arms(state)
        assert of(checks, "Power off").outcome == outcome


def test_the_way_to_the_start_is_told_in_millimetres() -> None:
    checks = running(cell())
    away = arms()
    away.needs_approach, away.approach_distance = True, 0.334
    checks.take_arms(away)
    assert "334 mm away" in of(checks, "Way to the start").detail


def test_a_camera_must_be_calibrated_and_see_the_rope() -> None:
    outside = cell("sensing.source=camera", "sensing.outside=true")
    checks = running(outside)
    assert "perception publishes nothing" in of(checks, "Camera").detail or not all(
        setup.calibrated for setup in outside.camera_setups
    )
    checks.take_rope(NodeChain(lost="too dark"))
    found = of(checks, "Camera")
    assert found.outcome == "failed"
