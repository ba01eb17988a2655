"""`lariat arm`, `disarm`, `ack` and `grip`: the arms of a live stack."""

from __future__ import annotations

import json as jsons
from collections.abc import Iterator
from typing import Annotated, Any, Literal

import tyro

from cli.task import HERE, ToCell
from shared.messages import ArmCommand, ArmStates
from shared.scenario import Side
from stack import client
from stack.client import Cell


def arm(json: bool = False, cell: ToCell = HERE) -> int:
    """Allow the arms to move. Look at the cell first.

    Examples:
      lariat arm

    Args:
        json: Answer with one JSON object on standard output.
        cell: Which stack.
    """
    return _command(ArmCommand.ARM, json, cell)


def disarm(json: bool = False, cell: ToCell = HERE) -> int:
    """Stop the arms and let nothing move them until they are armed again.

    Examples:
      lariat disarm

    Args:
        json: Answer with one JSON object on standard output.
        cell: Which stack.
    """
    return _command(ArmCommand.DISARM, json, cell)


def ack(json: bool = False, cell: ToCell = HERE) -> int:
    """Acknowledge why the arms hold, so that they may go on. Look at the cell first.

    Examples:
      lariat ack

    Args:
        json: Answer with one JSON object on standard output.
        cell: Which stack.
    """
    return _command(ArmCommand.ACKNOWLEDGE, json, cell)


def grip(
    wanted: Annotated[Literal["open", "close"], tyro.conf.Positional],
    /,
    side: Side = "right",
    json: bool = False,
    cell: ToCell = HERE,
) -> int:
    """Open or close a gripper, while the arms rest.

    Examples:
      lariat grip open
      lariat grip close --side left

    Args:
        wanted: open or close.
        side: Whose gripper.
        json: Answer with one JSON object on standard output.
        cell: Which stack.
    """
    return _command(ArmCommand.GRIPPER, json, cell, arm=side, close=wanted == "close")


def _command(action: ArmCommand.Action, json: bool, cell: Cell, **fields: Any) -> int:
    with client.open(cell) as talk:
        state = talk.arm(action, **fields)
    if json:
        print(jsons.dumps(as_json(state)))
    else:
        print(in_words(state))
    return 0


def in_words(state: ArmStates) -> str:
    """The state of the arms in one line."""
    words = ArmStates.Mode.Name(state.mode).lower()
    if state.reason:
        words += f": {state.reason}"
    if state.needs_acknowledgement:
        words += " (acknowledge with `lariat ack`)"
    return words


def each_in_words(state: ArmStates) -> Iterator[str]:
    """What every device says of itself, and what is wrong with it."""
    for arm in state.arms:
        if not arm.mode and not arm.alarms:
            continue
        words = [arm.mode or "not heard"]
        if arm.link_rate:
            words.append(f"heard at {arm.link_rate:.0f} Hz")
        if arm.tracking_error > 1e-3:
            words.append(f"{1e3 * arm.tracking_error:.0f} mm off its path")
        yield f"{arm.arm} ({arm.driver}): {', '.join([*words, *arm.alarms])}"


def as_json(state: ArmStates) -> dict[str, object]:
    """The state of the arms as `--json` says it."""
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
