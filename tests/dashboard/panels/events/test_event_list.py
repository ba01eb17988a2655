from __future__ import annotations

from typing import get_args

import pytest
from foxglove_schemas_protobuf.Log_pb2 import Log

from dashboard.panels.events.advice import ACKNOWLEDGE, ADVICE, APPROACH, advice
from dashboard.panels.events.event_list import EventList, Level, list_html
from lariat.safety.constraints.rule import Rule
from lariat.trajectory import SECOND
from shared.messages import FAILED, IDLE, RUNNING, ArmStates, TaskState, timestamp


def log(text: str, level: int = Log.Level.INFO, name: str = "sim", second: int = 1) -> Log:
    return Log(timestamp=timestamp(second * SECOND), level=level, message=text, name=name)


def texts(events: EventList, level: Level = Level.INFORMATION, words: str = "") -> list[str]:
    return [event.text for event in events.selected(level, words)]


def test_events_are_listed_newest_first_and_chosen_by_level_and_words() -> None:
    events = EventList()
    events.take_log(log("ready"))
    events.take_log(log("slow", Log.Level.WARNING, "controller"))
    events.take_log(log("gone", Log.Level.ERROR, "recorder"))
    assert texts(events) == ["gone", "slow", "ready"]
    assert texts(events, Level.WARNING) == ["gone", "slow"]
    assert texts(events, Level.ERROR) == ["gone"]
    assert texts(events, words="CONTROLLER") == ["slow"]
    assert texts(events, words="nothing") == []


def test_what_repeats_itself_is_counted() -> None:
    events = EventList()
    for second in range(1, 6):
        events.take_log(log("again", second=second))
    (event,) = events.selected(Level.INFORMATION, "")
    assert (event.count, event.time) == (5, 5 * SECOND)


def test_hold_is_listed_once_with_what_to_do() -> None:
    events = EventList()
    held = ArmStates(mode=ArmStates.HOLDING, reason="no fresh setpoints", rule="fresh")
    held.needs_acknowledgement = True
    events.take_arms(ArmStates(mode=ArmStates.MOVING, reason="following setpoints"))
    for _ in range(100):
        events.take_arms(held)
    (event,) = events.selected(Level.WARNING, "")
    assert "rule fresh" in event.text
    assert "acknowledge" in event.advice
    assert "acknowledge" in list_html([event])


@pytest.mark.parametrize("log_is_first", [True, False])
def test_stop_that_the_gateway_also_logs_is_listed_once_with_what_to_do(log_is_first: bool) -> None:
    events = EventList()
    held = ArmStates(mode=ArmStates.HOLDING, reason="held by a person", needs_acknowledgement=True)
    logged = log("holding: held by a person", Log.Level.WARNING, "robot_gateway")
    for _ in range(2):
        events.take_arms(ArmStates(mode=ArmStates.MOVING))
        for is_log in (log_is_first, not log_is_first):
            events.take_log(logged) if is_log else events.take_arms(held)
        events.take_log(log("the arms may move", name="robot_gateway"))
    newest, hold, *_ = events.selected(Level.INFORMATION, "")
    assert "may move" in newest.text
    assert (hold.text, hold.advice) == ("held by a person", ACKNOWLEDGE)
    assert texts(events).count("held by a person") == 2
    assert "holding: held by a person" not in texts(events)


def test_hold_of_the_controller_that_ends_by_itself_is_no_event() -> None:
    events = EventList()
    events.take_arms(ArmStates(mode=ArmStates.HOLDING, reason="waiting for a start"))
    assert texts(events) == []


def test_run_and_refusals_are_listed_as_they_change() -> None:
    events = EventList()
    events.take_task(TaskState(state=IDLE))
    for _ in range(3):
        events.take_task(TaskState(state=RUNNING, run="run-1", reason="started"))
    for _ in range(3):
        events.take_task(TaskState(state=FAILED, run="run-1", reason="no way"))
    for _ in range(3):
        refused = {"last_request": "a-1", "refusal": "already running"}
        events.take_task(TaskState(state=FAILED, run="run-1", reason="no way", **refused))
    assert texts(events) == [
        "request refused: already running",
        "run-1: failed: no way",
        "run-1: running: started",
    ]
    assert texts(events, Level.WARNING) == texts(events)[:2]


def test_text_of_a_stranger_is_no_html() -> None:
    events = EventList()
    events.take_log(log("<script>alert(1)</script>"))
    assert "<script>" not in list_html(events.selected(Level.INFORMATION, ""))


@pytest.mark.parametrize("rule", get_args(Rule))
def test_every_rule_of_the_gateway_has_advice(rule: str) -> None:
    assert advice(rule, True, False) == ADVICE[rule]


def test_advice_without_a_rule_is_that_of_the_next_step() -> None:
    assert advice("", True, False) == ACKNOWLEDGE
    assert advice("fresh", True, True) == APPROACH
    assert advice("", False, False) == ""
