"""`lariat start`, `pause`, `stop`, `reset`, `restore`: requests to the run of a running stack."""

from __future__ import annotations

import json as jsons
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import tyro

from lariat.scenario import load
from shared.messages import ArmStates, RunState, TaskRequest, TaskState
from stack.client import Cell, RequestFailed, connect

CellOptions = Annotated[Cell, tyro.conf.arg(name="", help="Address of the stack.")]
"""Options of every verb that talks to a running stack."""
JsonOption = Annotated[bool, tyro.conf.arg(help="Answer with one JSON object on standard output.")]
"""Option of verbs that print a result."""
LOCAL = Cell()
"""Stack on this machine."""


def start(
    scenario: Path | None = None,
    yes: bool = False,
    json: JsonOption = False,
    cell: CellOptions = LOCAL,
) -> int:
    """Start the run towards the goal, or resume a paused one. Real arms move only after a yes.

    Cell, scenario and arms are named on standard error before anything moves.

    Examples:
      lariat start
      lariat start --scenario three-cylinders
      lariat start --connect tcp/192.168.5.2:7448 --yes

    Args:
        scenario: Refuse unless the stack runs this scenario, a TOML file or a shipped one's name.
        yes: Answer yes to whether real arms may move, e.g. in a script.
    """
    name = load(scenario).name if scenario else ""
    with connect(cell) as client:
        arms = client.newest_arm_state()
        check_scenario(arms.scenario, name)
        print(f"cell {cell.namespace!r}, {description(arms)}", file=sys.stderr)
        confirm_real_arms(arms, yes)
        print_state(client.request_task(TaskRequest.START), json)
    return 0


def check_scenario(running: str, expected: str) -> None:
    """Refuse a stack that runs another scenario than the expected one; an empty one is any."""
    if expected and running != expected:
        raise RequestFailed(
            f"the stack runs scenario {running!r}, not {expected!r}; nothing was started: "
            "end it with Ctrl-C and start the other, or leave --scenario out"
        )


def description(arms: ArmStates) -> str:
    """Return scenario and kinds of arms in words."""
    kinds = ", ".join(
        f"{arm.arm} {arm.driver}{f' at {arm.address}' if arm.address else ' (not real)'}"
        for arm in arms.arms
    )
    return f"scenario {arms.scenario!r}: {kinds}"


def confirm_real_arms(arms: ArmStates, yes: bool) -> None:
    """Ask a person whether the real arms of a cell may move; do nothing where none is real."""
    real = [arm.arm for arm in arms.arms if arm.address]
    if not real or yes:
        return
    who = " and ".join(real) + (" arms" if len(real) > 1 else " arm")
    if not sys.stdin.isatty():
        raise RequestFailed(
            f"this would move the real {who}, and nobody can be asked; look at the cell and add "
            "--yes"
        )
    print(f"this moves the real {who}; is the cell clear? [y/N] ", end="", file=sys.stderr)
    sys.stderr.flush()
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        raise RequestFailed("nothing was started")


def _verb(name: str, action: TaskRequest.Action, text: str) -> Callable[..., int]:
    def verb(json: JsonOption = False, cell: CellOptions = LOCAL) -> int:
        with connect(cell) as client:
            print_state(client.request_task(action), json)
        return 0

    verb.__doc__ = f"{text}\n\nExamples:\n  lariat {name}"
    return verb


pause = _verb(
    "pause", TaskRequest.PAUSE, "Pause the run: the arms hold; `lariat start` resumes it."
)
stop = _verb("stop", TaskRequest.STOP, "End the run: the arms hold.")
reset = _verb(
    "reset",
    TaskRequest.RESET,
    "Return rope and arms to the scenario's start, in simulation only; goal and obstacles stay.",
)
restore = _verb(
    "restore",
    TaskRequest.RESTORE,
    "Return to the scenario as it was loaded, in simulation only: rope, arms, goal, obstacles.",
)


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
