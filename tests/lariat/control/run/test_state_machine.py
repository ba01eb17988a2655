"""Every transition of a run's state machine, and every event that a state does not accept."""

from __future__ import annotations

from itertools import product

import pytest

from lariat.control.run.state_machine import TRANSITIONS, RunEvent, RunState, accepts, next_state
from shared import messages

EXPECTED = {
    ("IDLE", "START"): "RUNNING",
    ("IDLE", "STOP"): "IDLE",
    ("IDLE", "RESET"): "IDLE",
    ("IDLE", "GOAL_EVENT"): "RUNNING",
    ("RUNNING", "PAUSE"): "PAUSED",
    ("RUNNING", "STOP"): "IDLE",
    ("RUNNING", "RESET"): "IDLE",
    ("RUNNING", "GOAL_EVENT"): "RUNNING",
    ("RUNNING", "SETTLE"): "REACHED",
    ("RUNNING", "GIVE_UP"): "FAILED",
    ("PAUSED", "START"): "RUNNING",
    ("PAUSED", "STOP"): "IDLE",
    ("PAUSED", "RESET"): "IDLE",
    ("REACHED", "START"): "RUNNING",
    ("REACHED", "STOP"): "IDLE",
    ("REACHED", "RESET"): "IDLE",
    ("REACHED", "NEW_GOAL"): "IDLE",
    ("REACHED", "LEAVE_GOAL"): "IDLE",
    ("REACHED", "GIVE_UP"): "FAILED",
    ("FAILED", "START"): "RUNNING",
    ("FAILED", "STOP"): "IDLE",
    ("FAILED", "RESET"): "IDLE",
    ("FAILED", "NEW_GOAL"): "IDLE",
}


@pytest.mark.parametrize(("state", "event"), EXPECTED)
def test_event_leads_to_its_state(state: str, event: str) -> None:
    after = next_state(RunState[state], RunEvent[event])
    assert after is RunState[EXPECTED[state, event]]


@pytest.mark.parametrize(
    ("state", "event"),
    [pair for pair in product(RunState, RunEvent) if (pair[0].name, pair[1].name) not in EXPECTED],
)
def test_other_events_are_not_accepted(state: RunState, event: RunEvent) -> None:
    assert not accepts(state, event)
    with pytest.raises(ValueError, match=f"{state.name}.*{event.name}"):
        next_state(state, event)


def test_table_has_no_other_entries() -> None:
    assert len(TRANSITIONS) == len(EXPECTED)


def test_states_are_those_of_the_message() -> None:
    assert {state.name for state in RunState} == set(messages.RunState.keys())
