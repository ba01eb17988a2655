"""`lariat arm`, `disarm`, `ack` and `grip`: commands to the arms of a running stack."""

from __future__ import annotations

import json as jsons
from collections.abc import Iterator
from typing import Annotated, Any, Literal

import tyro

from cli.task import LOCAL, CellOptions
from shared.messages import ArmCommand, ArmStates
from shared.scenario import Side
from stack.client import Cell, connect

TRACKING_ERROR_SHOWN = 1e-3
"""Tracking error above which it is printed [m]."""


def arm(json: bool = False, cell: CellOptions = LOCAL) -> int:
    """Arm: allow the arms to move. Look at the cell first.

    Examples:
      lariat arm

    Args:
        json: Answer with one JSON object on standard output.
        cell: Address of the stack.
    """
    return _command(ArmCommand.ARM, json, cell)


def disarm(json: bool = False, cell: CellOptions = LOCAL) -> int:
    """Stop the arms and keep them still until they are armed again.

    Examples:
      lariat disarm

    Args:
        json: Answer with one JSON object on standard output.
        cell: Address of the stack.
    """
    return _command(ArmCommand.DISARM, json, cell)


def ack(json: bool = False, cell: CellOptions = LOCAL) -> int:
    """Acknowledge the reason of a hold, so that the arms may move again. Look at the cell first.

    Examples:
      lariat ack

    Args:
        json: Answer with one JSON object on standard output.
        cell: Address of the stack.
    """
    return _command(ArmCommand.ACKNOWLEDGE, json, cell)


def grip(
    wanted: Annotated[Literal["open", "close"], tyro.conf.Positional],
    /,
    side: Side = "right",
    json: bool = False,
    cell: CellOptions = LOCAL,
) -> int:
    """Open or close a gripper while the arms stand still.

    Examples:
      lariat grip open
      lariat grip close --side left

    Args:
        wanted: open or close.
        side: Arm of the gripper.
        json: Answer with one JSON object on standard output.
        cell: Address of the stack.
    """
    return _command(ArmCommand.GRIPPER, json, cell, arm=side, close=wanted == "close")


def _command(action: ArmCommand.Action, json: bool, cell: Cell, **fields: Any) -> int:
    with connect(cell) as client:
        state = client.command_arms(action, **fields)
    if json:
        print(jsons.dumps(as_json(state)))
    else:
        print(summary_line(state))
    return 0


def summary_line(state: ArmStates) -> str:
    """Return the state of the arms in one line."""
    words = ArmStates.Mode.Name(state.mode).lower()
    if state.reason:
        words += f": {state.reason}"
    if state.needs_acknowledgement:
        words += " (acknowledge with `lariat ack`)"
    return words


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
