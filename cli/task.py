"""`lariat start`, `pause`, `stop`, `reset`, `restore`: requests to the run of a running stack."""

from __future__ import annotations

import json as jsons
from typing import Annotated

import tyro

from shared.messages import RunState, TaskRequest, TaskState
from stack.client import Cell, connect

CellOptions = Annotated[Cell, tyro.conf.arg(name="")]
"""Options of every verb that talks to a running stack."""
LOCAL = Cell()
"""Stack on this machine."""


def start(json: bool = False, cell: CellOptions = LOCAL) -> int:
    """Start the run towards the goal, or resume a paused one.

    Examples:
      lariat start
      lariat start --connect tcp/192.168.5.2:7447

    Args:
        json: Answer with one JSON object on standard output.
        cell: Address of the stack.
    """
    return _request(TaskRequest.START, json, cell)


def pause(json: bool = False, cell: CellOptions = LOCAL) -> int:
    """Pause the run: the arms hold; `lariat start` resumes it.

    Examples:
      lariat pause

    Args:
        json: Answer with one JSON object on standard output.
        cell: Address of the stack.
    """
    return _request(TaskRequest.PAUSE, json, cell)


def stop(json: bool = False, cell: CellOptions = LOCAL) -> int:
    """End the run: the arms hold.

    Examples:
      lariat stop

    Args:
        json: Answer with one JSON object on standard output.
        cell: Address of the stack.
    """
    return _request(TaskRequest.STOP, json, cell)


def reset(json: bool = False, cell: CellOptions = LOCAL) -> int:
    """Return rope and arms to the scenario's start, in simulation only; goal and obstacles stay.

    Examples:
      lariat reset

    Args:
        json: Answer with one JSON object on standard output.
        cell: Address of the stack.
    """
    return _request(TaskRequest.RESET, json, cell)


def restore(json: bool = False, cell: CellOptions = LOCAL) -> int:
    """Return to the scenario as it was loaded, in simulation only: rope, arms, goal, obstacles.

    Examples:
      lariat restore

    Args:
        json: Answer with one JSON object on standard output.
        cell: Address of the stack.
    """
    return _request(TaskRequest.RESTORE, json, cell)


def _request(action: TaskRequest.Action, json: bool, cell: Cell) -> int:
    with connect(cell) as client:
        print_state(client.request_task(action), json)
    return 0


def print_state(state: TaskState, json: bool) -> None:
    """Print the state of the task, as a line or as one JSON object."""
    if json:
        print(jsons.dumps(as_json(state)))
        return
    name = RunState.Name(state.state).lower()
    print(f"{name}: {state.reason}" if state.reason else name)


def as_json(state: TaskState) -> dict[str, object]:
    """Return the state of the task as `--json` prints it."""
    return {
        "state": RunState.Name(state.state).lower(),
        "reason": state.reason,
        "run": state.run,
        "goal_revision": state.goal_revision,
        "error_mm": round(1e3 * state.error, 4),
        "clearance_mm": round(1e3 * state.clearance, 4),
    }
