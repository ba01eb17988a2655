"""What the page says: states, distances and refusals in words."""

from __future__ import annotations

import html
import math
from dataclasses import dataclass

from dashboard import palette
from dashboard.palette import Color
from shared import messages
from shared.messages import ArmState, ArmStates, NodeChain, TaskState

SILENT = 2.5
"""Age from which an owner that should speak each second counts as silent [s]."""

MODES = {
    ArmStates.DISARMED: ("Disarmed", palette.QUIET),
    ArmStates.ARMED: ("Armed, standing still", palette.GOOD),
    ArmStates.MOVING: ("Moving", palette.BUSY),
    ArmStates.HOLDING: ("Holding still", palette.QUIET),
    ArmStates.FAULT: ("Fault", palette.BAD),
}


@dataclass(frozen=True)
class Line:
    """One statement with the colour of its urgency."""

    text: str
    color: Color
    detail: str = ""
    """What else there is to know, or to do."""


def millimeters(value: float) -> str:
    """A distance [m] as a person reads it."""
    if not math.isfinite(value):
        return "–"
    value *= 1e3
    return f"{value:.2f} mm" if abs(value) < 1.0 else f"{value:.1f} mm"


def headline(
    task: TaskState | None,
    age: float,
    arms: ArmStates | None,
    rope: NodeChain | None = None,
) -> Line:
    """The state of the whole cell in one line.

    Args:
        task: The controller's last word.
        age: How long ago it came [s].
        arms: The gateway's last word.
        rope: What perception saw last.
    """
    if task is None:
        return Line("Waiting for the controller", palette.QUIET)
    if age > SILENT:
        return Line(f"The controller is silent for {age:.0f} s", palette.BAD, "See Health.")
    seen = rope is None or not rope.lost
    togo = f"{millimeters(task.error)} to go" if seen else "rope lost"
    clearance = (
        f", clearance {millimeters(task.clearance)}"
        if seen and math.isfinite(task.clearance)
        else ""
    )
    need = _arms_need(arms)
    detail = need or task.reason
    match task.state:
        case messages.RUNNING:
            text = "Running, but held" if need else "Running"
            color = palette.WARNING if need else palette.BUSY
            return Line(f"{text}: {togo}{clearance}", color, detail)
        case messages.PAUSED:
            return Line(f"Paused: {togo}{clearance}", palette.WARNING, detail)
        case messages.REACHED:
            text = f"Reached: {millimeters(task.error)} from the goal{clearance}"
            return Line(text, palette.GOOD, detail)
        case messages.FAILED:
            return Line(f"Failed: {task.reason or 'no reason given'}", palette.BAD, togo)
        case messages.IDLE:
            text = f"Not ready: {togo}" if need else f"Ready: {togo}"
            color = palette.WARNING if need else palette.QUIET
            return Line(text, color, need or task.reason or "Press Start.")
    return Line(f"Unknown run state {task.state}", palette.BAD)


def _arms_need(arms: ArmStates | None) -> str:
    if arms is None:
        return "The robot gateway is silent."
    if arms.needs_acknowledgement:
        return "The arms hold until a person acknowledges."
    if arms.mode == ArmStates.DISARMED:
        return "The arms are disarmed."
    if arms.mode == ArmStates.FAULT:
        return "The arms report a fault."
    return ""


def arms_line(arms: ArmStates | None, age: float) -> Line:
    """What the arms do and why."""
    if arms is None:
        return Line("No word from the gateway yet", palette.QUIET)
    if age > SILENT:
        return Line(f"The gateway is silent for {age:.0f} s", palette.BAD)
    text, color = MODES.get(arms.mode, (f"Unknown mode {arms.mode}", palette.BAD))
    if arms.needs_acknowledgement:
        color = palette.BAD if arms.mode == ArmStates.FAULT else palette.WARNING
    parts = [arms.reason] if arms.reason else []
    if arms.rule and arms.mode in (ArmStates.HOLDING, ArmStates.FAULT):
        parts.append(f"rule “{arms.rule}”")
    parts += [f"{a.arm}: {alarm}" for a in arms.arms for alarm in a.alarms]
    return Line(text, color, "; ".join(parts))


def arm_words(arm: ArmState) -> str:
    """One arm in a line: what it does, how it is heard, how well it follows."""
    parts = [arm.mode or arm.driver]
    if arm.link_rate:
        gap = 1e3 * arm.link_gap
        parts.append(f"heard {arm.link_rate:.0f} times a second, longest gap {gap:.0f} ms")
    if arm.tracking_error:
        parts.append(f"{millimeters(arm.tracking_error)} off its path")
    if arm.pull >= 1.0:
        parts.append(f"feels a pull of {arm.pull:.0f} N")
    if arm.driver != "fixed":
        parts.append("gripper closed" if arm.gripper_closed else "gripper open")
    return f"{arm.arm}: {', '.join(parts)}"


def as_html(line: Line, size: str = "1.05em", margin: str = "0.6em 1em") -> str:
    """A line with its coloured dot."""
    detail = (
        f'<div style="opacity:.75;font-size:.85em;margin-top:.25em;line-height:1.35">'
        f"{html.escape(line.detail)}</div>"
        if line.detail
        else ""
    )
    return (
        f'<div style="margin:{margin};display:flex;gap:.6em;align-items:baseline">'
        f'<span style="flex:none;width:.7em;height:.7em;border-radius:50%;'
        f'background:{palette.css(line.color)};box-shadow:0 0 .5em {palette.css(line.color, 0.6)}">'
        f'</span><div style="font-size:{size}"><b>{html.escape(line.text)}</b>{detail}</div></div>'
    )
