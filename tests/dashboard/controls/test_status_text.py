from __future__ import annotations

import pytest

from dashboard import palette
from dashboard.controls import status_text
from shared.messages import (
    FAILED,
    IDLE,
    PAUSED,
    REACHED,
    RUNNING,
    ArmState,
    ArmStates,
    Goal,
    NodeChain,
    Path,
    TaskState,
)

ARMED = ArmStates(mode=ArmStates.ARMED)


def task(state: int, **fields: object) -> TaskState:
    return TaskState(**{"state": state, "error": 0.0123, "clearance": 0.023, **fields})


@pytest.mark.parametrize(
    ("state", "text"),
    [
        (task(IDLE), "Ready: 12.3 mm to go"),
        (task(RUNNING), "Running: 12.3 mm to go, clearance 23.0 mm"),
        (task(PAUSED), "Paused: 12.3 mm to go, clearance 23.0 mm"),
        (task(REACHED, error=0.0004), "Reached: 0.40 mm from the goal, clearance 23.0 mm"),
        (task(FAILED, reason="the rope is lost"), "Failed: the rope is lost"),
        (task(RUNNING, clearance=float("inf")), "Running: 12.3 mm to go"),
        (
            task(RUNNING, goal=Goal(ends_only=True), angle_error=0.2, clearance=float("inf")),
            "Running: 12.3 mm and 11.5° of the ends to go",
        ),
    ],
)
def test_headline_says_state_and_distances(state: TaskState, text: str) -> None:
    assert status_text.headline(state, 0.1, ARMED).text == text


def test_detail_says_what_is_laid_and_how_much_the_cable_is_pulled() -> None:
    state = task(
        RUNNING, goal=Goal(route=["a", "left of peg", "b"]), tension=0.138, reason="started"
    )
    assert status_text.laid(state, ["a"], None) == "1 of 2 clips laid"
    laid = status_text.laid(state, ["a"], 2.0)
    facts = laid, status_text.certain(None)
    line = status_text.headline(state, 0.1, ARMED, facts=facts)
    assert line.detail == "1 of 2 clips laid, tension 0.14 of 2 N; started"
    lost = status_text.headline(state, 0.1, ARMED, NodeChain(lost="too few pixels"), facts=facts)
    assert lost.detail == "started"


def test_what_is_certain_of_a_path_is_said_where_it_is_less_than_planned() -> None:
    path = Path(reached=True, clearance=0.0131, certain_clearance=0.0048)
    assert status_text.certain(path) == "the path keeps 13.1 mm, with 99 % 4.8 mm"
    assert status_text.certain(Path(reached=True, clearance=0.01, certain_clearance=0.01)) == ""
    assert status_text.certain(Path(clearance=0.0131, certain_clearance=0.0048)) == ""


def test_headline_of_a_silent_controller_does_not_repeat_its_last_state() -> None:
    line = status_text.headline(task(RUNNING), 4.2, ARMED)
    assert all(w in line.text for w in ("controller", "silent", "4 s"))
    assert line.color == palette.BAD


def test_headline_gives_no_distance_of_a_lost_rope() -> None:
    line = status_text.headline(task(RUNNING), 0.1, ARMED, NodeChain(lost="too few pixels"))
    assert line.text == "Running: rope lost"


def test_cell_is_not_ready_while_the_arms_are_not() -> None:
    waiting = ArmStates(mode=ArmStates.HOLDING, needs_acknowledgement=True)
    for arms in (None, ArmStates(mode=ArmStates.DISARMED), waiting):
        line = status_text.headline(task(IDLE), 0.1, arms)
        assert line.text.startswith("Not ready")
        assert line.detail


def test_run_that_the_gateway_holds_is_not_shown_as_running() -> None:
    held = ArmStates(mode=ArmStates.HOLDING, needs_acknowledgement=True)
    line = status_text.headline(task(RUNNING, reason="started"), 0.1, held)
    assert line.text.startswith("Held: ")
    assert "acknowledges" in line.detail
    held.reason = "held by a person"
    line = status_text.headline(task(RUNNING), 0.1, held, simulated=True)
    assert "Continue" in line.detail


def test_gateway_status_names_rule_reason_and_alarms() -> None:
    arms = ArmStates(
        mode=ArmStates.HOLDING,
        rule="fresh",
        reason="no setpoints for 100 ms",
        arms=[ArmState(arm="right", alarms=["joint 3 over temperature"])],
    )
    line = status_text.gateway_status(arms, 0.0)
    assert line.text == "Holding still"
    for words in ("no setpoints for 100 ms", "right: joint 3 over temperature"):
        assert words in line.detail
    assert line.rule == "fresh"
    assert "fresh" not in line.detail
    assert 'title="rule fresh"' in status_text.as_html(line)


def test_arm_status_names_mode_link_tracking_error_force_and_gripper() -> None:
    arm = ArmState(
        arm="right",
        driver="cr5",
        mode="running",
        link_rate=124.0,
        link_gap=0.017,
        tracking_error=0.0004,
        pull=7.2,
    )
    facts = ("right", "running", "124 Hz", "17 ms", "0.40 mm", "7 N", "gripper open")
    assert all(fact in status_text.arm_status(arm) for fact in facts)
    assert status_text.arm_status(ArmState(arm="left", driver="fixed")) == "left: fixed"


def test_text_from_the_bus_cannot_become_markup() -> None:
    assert "<script>" not in status_text.as_html(
        status_text.StatusLine("<script>", palette.BAD, detail="<script>")
    )


def test_headline_says_which_services_are_missing() -> None:
    line = status_text.headline(None, 0.0, None, unheard=["sim", "robot_gateway"])
    assert all(w in line.detail for w in ("sim, robot gateway", "lariat up"))
