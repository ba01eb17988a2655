"""`lariat arm`, `approach`, `disarm`, `ack`, `resume`, `grip`: commands to a stack's arms."""

from __future__ import annotations

import json as jsons
import sys
from collections.abc import Callable, Iterator
from typing import Annotated, Any, Literal

import tyro

from cli.held_key import held_key
from cli.task import LOCAL, CellOptions, JsonOption
from lariat.plain_text import plain_text
from lariat.scenario import Side
from shared.messages import ArmCommand, ArmStates
from stack.approach import approach as approach_start
from stack.client import Cell, RequestFailed, connect

TRACKING_ERROR_SHOWN = 1e-3
"""Tracking error above which it is printed [m]."""


def approach(distance: Annotated[float, tyro.conf.Positional], /, cell: CellOptions = LOCAL) -> int:
    """Let the arms go slowly to the start while you hold a key down. Look at the cell all the time.

    Examples:
      lariat approach 334

    Args:
        distance: Distance to the start that `lariat arm` or `lariat status` shows [mm].

    Returns:
        0 when the arms are at the start, 1 when the key was released before.
    """
    if not sys.stdin.isatty():
        raise RequestFailed("an approach needs a terminal, at which a person holds a key down")
    with connect(cell) as client, held_key() as is_held:
        print("hold the space bar down; the arms stop when it is released", flush=True)
        is_held.wait()
        shown = client.newest_arm_state()
        ended = approach_start(client, shown, 1e-3 * distance, is_held)
        print(ended or summary_line(client.newest_arm_state()))
    return 1 if ended else 0


def grip(
    motion: Annotated[Literal["open", "close"], tyro.conf.Positional],
    /,
    side: Side = "right",
    json: JsonOption = False,
    cell: CellOptions = LOCAL,
) -> int:
    """Open or close a gripper while the arms stand still.

    Examples:
      lariat grip open
      lariat grip close --side left

    Args:
        side: Arm of the gripper.
    """
    return _command(ArmCommand.GRIPPER, json, cell, arm=side, close=motion == "close")


def _verb(name: str, action: ArmCommand.Action, text: str) -> Callable[..., int]:
    def verb(json: JsonOption = False, cell: CellOptions = LOCAL) -> int:
        return _command(action, json, cell)

    verb.__doc__ = f"{text}\n\nExamples:\n  lariat {name}"
    return verb


def _command(action: ArmCommand.Action, json: bool, cell: Cell, **fields: Any) -> int:
    with connect(cell) as client:
        state = client.command_arms(action, **fields)
    if json:
        print(jsons.dumps(as_json(state)))
    else:
        print(summary_line(state))
    return 0


arm = _verb("arm", ArmCommand.ARM, "Arm: allow arms at the start to move. Look at the cell first.")
disarm = _verb(
    "disarm",
    ArmCommand.DISARM,
    "Stop the arms, take their power, and keep them still until they are armed again.",
)
ack = _verb(
    "ack",
    ArmCommand.ACKNOWLEDGE,
    "Acknowledge the reason of a hold. Nothing moves until `lariat resume`.",
)
resume = _verb(
    "resume",
    ArmCommand.RESUME,
    "Allow acknowledged arms to move again: a run goes on. Look at the cell first.",
)


def summary_line(state: ArmStates) -> str:
    """Return the state of the arms in one line."""
    words = ArmStates.Mode.Name(state.mode).lower()
    if state.reason:
        words += f": {state.reason}"
    if state.needs_acknowledgement:
        words += " (acknowledge with `lariat ack`)"
    elif state.needs_resume:
        words += " (resume with `lariat resume`)"
    elif state.needs_approach:
        distance = 1e3 * state.approach_distance
        words += f" (go to the start with `lariat approach {distance:.0f}`)"
    return plain_text(words)


def device_lines(state: ArmStates) -> Iterator[str]:
    """Yield a line with state and alarms of each device."""
    for arm in state.arms:
        if not arm.mode and not arm.alarms:
            continue
        words = [arm.mode or "no feedback"]
        if arm.link_rate:
            words.append(f"feedback at {arm.link_rate:.0f} Hz")
        if arm.tracking_error > TRACKING_ERROR_SHOWN:
            words.append(f"{1e3 * arm.tracking_error:.0f} mm off its path")
        yield f"{arm.arm} ({arm.driver}): {', '.join([*words, *arm.alarms])}"


def as_json(state: ArmStates) -> dict[str, object]:
    """Return the state of the arms as `--json` prints it."""
    return {
        "mode": ArmStates.Mode.Name(state.mode).lower(),
        "cause": state.cause,
        "reason": state.reason,
        "rule": state.rule,
        "needs_acknowledgement": state.needs_acknowledgement,
        "needs_resume": state.needs_resume,
        "needs_approach": state.needs_approach,
        "approach_mm": round(1e3 * state.approach_distance, 1),
        "approach_rad": round(state.approach_angle, 3),
        "powered": any(a.powered for a in state.arms),
        "arms": {
            a.arm: {
                "driver": a.driver,
                "mode": a.mode,
                "position": list(a.position),
                "alarms": list(a.alarms),
                "gripper_closed": a.gripper_closed,
                "tracking_error_mm": round(1e3 * a.tracking_error, 3),
                "pull_n": round(a.pull, 2),
                "link_hz": a.link_rate,
                "link_gap_ms": round(1e3 * a.link_gap, 1),
            }
            for a in state.arms
        },
    }
