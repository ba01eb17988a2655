"""State machine of a run: states, events and the table of transitions."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto


class RunState(Enum):
    """State of the task, as in the message `RunState`."""

    IDLE = auto()
    """Waiting for a start; the arms hold."""
    RUNNING = auto()
    """Moving the rope to its goal."""
    PAUSED = auto()
    """Holding until a start resumes the run."""
    REACHED = auto()
    """At the goal; control goes on."""
    FAILED = auto()
    """Given up; the arms hold."""


class RunEvent(Enum):
    """Event that may change the state."""

    START = auto()
    """Request to start, or to resume a paused run."""
    PAUSE = auto()
    """Request to pause."""
    STOP = auto()
    """Request to end the run."""
    RESET = auto()
    """Request to return a simulation to its start."""
    NEW_GOAL = auto()
    """The goal has been replaced."""
    GOAL_EVENT = auto()
    """The goal has been replaced by an event of the scenario, which goes on with the run."""
    SETTLE = auto()
    """The rope rests within tolerance of the goal."""
    LEAVE_GOAL = auto()
    """The rope has left the goal and is not led back."""
    GIVE_UP = auto()
    """The goal cannot be reached."""


TRANSITIONS: Mapping[tuple[RunState, RunEvent], RunState] = {
    (RunState.IDLE, RunEvent.START): RunState.RUNNING,
    (RunState.PAUSED, RunEvent.START): RunState.RUNNING,
    (RunState.REACHED, RunEvent.START): RunState.RUNNING,
    (RunState.FAILED, RunEvent.START): RunState.RUNNING,
    (RunState.RUNNING, RunEvent.PAUSE): RunState.PAUSED,
    **{(state, RunEvent.STOP): RunState.IDLE for state in RunState},
    **{(state, RunEvent.RESET): RunState.IDLE for state in RunState},
    (RunState.REACHED, RunEvent.NEW_GOAL): RunState.IDLE,
    (RunState.FAILED, RunEvent.NEW_GOAL): RunState.IDLE,
    (RunState.RUNNING, RunEvent.GOAL_EVENT): RunState.RUNNING,
    (RunState.IDLE, RunEvent.GOAL_EVENT): RunState.RUNNING,
    (RunState.RUNNING, RunEvent.SETTLE): RunState.REACHED,
    (RunState.REACHED, RunEvent.LEAVE_GOAL): RunState.IDLE,
    (RunState.RUNNING, RunEvent.GIVE_UP): RunState.FAILED,
    (RunState.REACHED, RunEvent.GIVE_UP): RunState.FAILED,
}
"""State after an event; events without an entry are not accepted in that state."""

ACTIVE = frozenset({RunState.RUNNING, RunState.REACHED})
"""States in which the arms are controlled."""


def accepts(state: RunState, event: RunEvent) -> bool:
    """Whether an event has a transition from a state."""
    return (state, event) in TRANSITIONS


def next_state(state: RunState, event: RunEvent) -> RunState:
    """State after an event.

    Raises:
        ValueError: The state does not accept the event.
    """
    if not accepts(state, event):
        raise ValueError(f"state {state.name} does not accept the event {event.name}")
    return TRANSITIONS[state, event]
