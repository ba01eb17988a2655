"""`lariat start`, `pause`, `stop` and `reset`: the run of a live stack."""

from __future__ import annotations

import json as jsons
from typing import Annotated

import tyro

from shared.messages import RunState, TaskRequest, TaskState
from stack import client
from stack.client import Cell

ToCell = Annotated[Cell, tyro.conf.arg(name="")]
HERE = Cell()
"""The stack of this machine."""


def start(json: bool = False, cell: ToCell = HERE) -> int:
    """Start the run towards the goal, or resume a paused one.

    Examples:
      lariat start
      lariat start --connect tcp/192.168.5.2:7447

    Args:
        json: Answer with one JSON object on standard output.
        cell: Which stack.
    """
    return _ask(TaskRequest.START, json, cell)


def pause(json: bool = False, cell: ToCell = HERE) -> int:
    """Pause the run: the arms hold, and `lariat start` goes on.

    Examples:
      lariat pause

    Args:
        json: Answer with one JSON object on standard output.
        cell: Which stack.
    """
    return _ask(TaskRequest.PAUSE, json, cell)


def stop(json: bool = False, cell: ToCell = HERE) -> int:
    """End the run: the arms hold.

    Examples:
      lariat stop

    Args:
        json: Answer with one JSON object on standard output.
        cell: Which stack.
    """
    return _ask(TaskRequest.STOP, json, cell)


def reset(json: bool = False, cell: ToCell = HERE) -> int:
    """Put rope and arms back to the scenario's start; simulation only.

    Examples:
      lariat reset

    Args:
        json: Answer with one JSON object on standard output.
        cell: Which stack.
    """
    return _ask(TaskRequest.RESET, json, cell)


def _ask(action: TaskRequest.Action, json: bool, cell: Cell) -> int:
    with client.open(cell) as talk:
        say(talk.task(action), json)
    return 0


def say(state: TaskState, json: bool) -> None:
    """Prints the state of the task."""
    if json:
        print(jsons.dumps(as_json(state)))
        return
    name = RunState.Name(state.state).lower()
    print(f"{name}: {state.reason}" if state.reason else name)


def as_json(state: TaskState) -> dict[str, object]:
    """The state of the task as `--json` says it."""
    return {
        "state": RunState.Name(state.state).lower(),
        "reason": state.reason,
        "run": state.run,
        "goal_revision": state.goal_revision,
        "error_mm": round(1e3 * state.error, 4),
        "clearance_mm": round(1e3 * state.clearance, 4),
    }
