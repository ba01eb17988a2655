"""Status lines of the page: states, distances and refusals as text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from dashboard import palette
from dashboard.markup import escaped
from dashboard.palette import Color
from dashboard.subscriptions import STALE_AGE
from lariat.geometry.cable_routes import clip_names
from shared import messages
from shared.arm_rest import stands
from shared.messages import ArmState, ArmStates, NodeChain, Path, TaskState

MIN_SHOWN_FORCE = 1.0
"""Contact force below which it is not shown [N]."""

GATEWAY_MODES = {
    ArmStates.DISARMED: ("Disarmed", palette.QUIET),
    ArmStates.ARMED: ("Armed, standing still", palette.GOOD),
    ArmStates.MOVING: ("Moving", palette.BUSY),
    ArmStates.HOLDING: ("Holding still", palette.QUIET),
    ArmStates.FAULT: ("Fault", palette.BAD),
}
"""Text and colour of each mode of the gateway."""


@dataclass(frozen=True)
class StatusLine:
    """Statement with a coloured dot."""

    text: str
    """Statement."""
    color: Color
    """Colour of the dot."""
    detail: str = ""
    """Reason, or the next thing to do; shown below the text in smaller type."""
    rule: str = ""
    """Name of the rule that was violated, shown where the pointer rests on the line."""


def format_millimeters(length: float) -> str:
    """Format a length [m] in millimetres; a dash where it is not finite."""
    if not math.isfinite(length):
        return "–"
    length *= 1e3
    return f"{length:.2f} mm" if abs(length) < 1.0 else f"{length:.1f} mm"


def headline(
    task: TaskState | None,
    task_age: float,
    arms: ArmStates | None,
    rope: NodeChain | None = None,
    unheard: Sequence[str] = (),
    simulated: bool = False,
    facts: Sequence[str] = (),
) -> StatusLine:
    """State of the whole cell in one line; empty `facts` are left out."""
    if task is None:
        names = ", ".join(name.replace("_", " ") for name in unheard)
        missing = f"Nothing is heard from: {names}. lariat up starts them all." if names else ""
        return StatusLine("Connecting …", palette.QUIET, missing)
    if task_age > STALE_AGE:
        text = f"The controller is silent for {task_age:.0f} s"
        return StatusLine(text, palette.BAD, "See the tab Health.")
    is_seen = rope is None or not rope.lost
    distance = format_millimeters(task.error)
    if task.goal.ends_only:
        distance += f" and {math.degrees(task.angle_error):.1f}° of the ends"
    remaining = f"{distance} to go" if is_seen else "rope lost"
    clearance = (
        f", clearance {format_millimeters(task.clearance)}"
        if is_seen and math.isfinite(task.clearance)
        else ""
    )
    obstruction = _arms_obstruction(arms, simulated)
    detail = obstruction or task.reason
    if is_seen:
        detail = "; ".join(filter(None, (*facts, detail)))
    match task.state:
        case messages.RUNNING:
            text = "Held" if obstruction else "Running"
            color = palette.WARNING if obstruction else palette.BUSY
            return StatusLine(f"{text}: {remaining}{clearance}", color, detail)
        case messages.PAUSED:
            return StatusLine(f"Paused: {remaining}{clearance}", palette.WARNING, detail)
        case messages.REACHED:
            text = f"Reached: {distance} from the goal{clearance}"
            return StatusLine(text, palette.GOOD, detail)
        case messages.FAILED:
            text = f"Failed: {task.reason or 'no reason given'}"
            return StatusLine(text, palette.BAD, remaining)
        case messages.IDLE:
            text = f"Not ready: {remaining}" if obstruction else f"Ready: {remaining}"
            color = palette.WARNING if obstruction else palette.QUIET
            return StatusLine(text, color, detail)
    return StatusLine(f"Unknown run state {task.state}", palette.BAD)


def laid(task: TaskState, held: Sequence[str], limit: float | None) -> str:
    """How many clips of the goal's route hold the cable, and how much it is pulled; `limit` [N]."""
    text = f"{len(held)} of {len(clip_names(task.goal.route))} clips laid"
    return text if limit is None else f"{text}, tension {task.tension:.2f} of {limit:g} N"


def certain(path: Path | None) -> str:
    """Clearance that a path keeps with a probability of 99 %; empty where it is the path's own."""
    if path is None or not path.reached or path.certain_clearance >= path.clearance:
        return ""
    certain, planned = map(format_millimeters, (path.certain_clearance, path.clearance))
    return f"the path keeps {planned}, with 99 % {certain}"


def _arms_obstruction(arms: ArmStates | None, simulated: bool) -> str:
    """Reason why the arms would not move; empty when they would."""
    if arms is None:
        return "The robot gateway is silent."
    if simulated and (arms.needs_acknowledgement or arms.needs_resume):
        reason = arms.reason or "the arms hold"
        return f"{reason[0].upper()}{reason[1:]}. Continue lets the arms move again."
    if arms.needs_acknowledgement:
        return "The arms hold until a person acknowledges."
    if arms.needs_resume:
        return "The arms stand until a person resumes them."
    if arms.needs_approach:
        return "The arms are away from the start: approach first."
    if arms.mode == ArmStates.DISARMED:
        return "The arms are disarmed."
    if arms.mode == ArmStates.FAULT:
        return "The arms report a fault."
    return ""


def gateway_status(arms: ArmStates | None, age: float) -> StatusLine:
    """Mode of the gateway, with its reason, the violated rule and the alarms of the arms."""
    if arms is None:
        return StatusLine("Waiting for the robot gateway", palette.QUIET)
    if age > STALE_AGE:
        return StatusLine(f"The robot gateway is silent for {age:.0f} s", palette.BAD)
    text, color = GATEWAY_MODES.get(arms.mode, (f"Unknown mode {arms.mode}", palette.BAD))
    if arms.mode == ArmStates.MOVING and all(stands(a) for a in arms.arms):
        text, color = "At rest, following", palette.GOOD
    if arms.approaching:
        text, color = "Approaching the start", palette.BUSY
    if arms.needs_resume:
        text, color = "Acknowledged, standing still", palette.WARNING
    if arms.mode == ArmStates.DISARMED and any(a.powered for a in arms.arms):
        text, color = "Disarmed, still powered", palette.WARNING
    if arms.needs_acknowledgement:
        color = palette.BAD if arms.mode == ArmStates.FAULT else palette.WARNING
    details = [arms.reason] if arms.reason else []
    rule = arms.rule if arms.mode in (ArmStates.HOLDING, ArmStates.FAULT) else ""
    details += [f"{a.arm}: {alarm}" for a in arms.arms for alarm in a.alarms]
    return StatusLine(text, color, "; ".join(details), rule)


def arm_status(arm: ArmState) -> str:
    """Mode, link quality, tracking error, contact force and gripper of one arm."""
    parts = [arm.mode or arm.driver]
    if arm.link_rate:
        gap = 1e3 * arm.link_gap
        parts.append(f"feedback at {arm.link_rate:.0f} Hz, longest gap {gap:.0f} ms")
    if arm.tracking_error:
        parts.append(f"tracking error {format_millimeters(arm.tracking_error)}")
    if arm.pull >= MIN_SHOWN_FORCE:
        parts.append(f"contact force {arm.pull:.0f} N")
    if arm.driver != "fixed":
        parts.append("gripper closed" if arm.gripper_closed else "gripper open")
    return f"{arm.arm}: {', '.join(parts)}"


def as_html(line: StatusLine, size: str = "1.05em", margin: str = "0.6em 1em") -> str:
    """HTML of a status line."""
    detail = (
        f'<div style="opacity:.75;font-size:.85em;margin-top:.25em;line-height:1.35">'
        f"{escaped(line.detail)}</div>"
        if line.detail
        else ""
    )
    rule = f' title="rule {escaped(line.rule)}"' if line.rule else ""
    return (
        f'<div style="margin:{margin};display:flex;gap:.6em;align-items:baseline"{rule}>'
        f'<span style="flex:none;width:.7em;height:.7em;border-radius:50%;'
        f'background:{palette.css(line.color)};box-shadow:0 0 .5em {palette.css(line.color, 0.6)}">'
        f'</span><div style="font-size:{size}"><b>{escaped(line.text)}</b>{detail}</div></div>'
    )
