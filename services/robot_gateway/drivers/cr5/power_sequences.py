"""Sequences that enable a CR5 (clear alarms, discard old motion, power on, enable, apply settings)
and that disable it (stop, wait for rest, disable the drives).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from services.robot_gateway.drivers.cr5.command_sequence import Request, SequenceSteps, WaitUntil
from services.robot_gateway.drivers.cr5.replies import Reply
from shared.cr5.alarms import FOLLOWING_MODES

POWER_ON_TIMEOUT = 20.0
"""Time limit from PowerOn until the arm can be enabled; the vendor states 10 s [s]."""
POWER_ON_DELAY = 0.2
"""Time after PowerOn before the mode is read [s]."""
REST_TIMEOUT = 0.3
"""Time limit from the stop until the arm rests, after which it is disabled in motion [s]."""
DISABLE_TIMEOUT = 0.5
"""Time limit from DisableRobot until the feedback reports that the drives are off [s]."""
IDLE_TIMEOUT = 3.0
"""Time limit from the last setting until the arm is idle [s]."""
STARTING, NO_POWER, DISABLED, IDLE, HAND_GUIDED, IN_ALARM = 1, 3, 4, 5, 6, 9
"""Values of RobotMode, as in `shared.cr5.alarms.MODE_TEXTS`."""
STOP_COMMANDS: dict[Literal["v3", "v4"], tuple[str, str]] = {
    "v3": ("ResetRobot()", "DisableRobot()"),
    "v4": ("Stop()", "DisableRobot()"),
}
"""Command that stops any motion, and the one that takes the power, by version of the protocol."""
UNPOWERED_MODES = (NO_POWER, DISABLED)
"""Modes in which the drives are off and the brakes on."""


@dataclass(frozen=True)
class EnableSettings:
    """Settings that are applied each time the arm is enabled."""

    load: float = 0.0
    """Mass at the flange [kg]."""
    load_center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Centre of that mass in the flange frame [m]."""
    collision_level: int = 3
    """Collision detection: 0 (off) to 5 (most sensitive)."""


def enable_steps(
    firmware: Literal["v3", "v4"] | None,
    mode: Callable[[], int | None],
    describe: Callable[[], str],
    alarms: Callable[[], tuple[str, ...]],
    settings: EnableSettings,
) -> SequenceSteps:
    """Yield the steps after which the arm follows servo points; return the failure in words."""
    if firmware == "v4":
        # An error is fine: older firmware lacks the command, and an enabled arm refuses it.
        yield Request("RequestControl()")
        yield Request("EmergencyStop(0)")
    if mode() not in FOLLOWING_MODES:
        yield Request("ClearError()")
    yield Request(STOP_COMMANDS[firmware or "v4"][0])
    if mode() == HAND_GUIDED:
        yield Request("StopDrag()")
    if mode() in (STARTING, NO_POWER, IN_ALARM):
        # On V3 this also resets a software emergency stop.
        reply = yield Request("PowerOn()")
        yield WaitUntil(lambda: False, POWER_ON_DELAY)
        if not (yield WaitUntil(lambda: mode() in (DISABLED, *FOLLOWING_MODES), POWER_ON_TIMEOUT)):
            words = reply.words if isinstance(reply, Reply) and reply.error else ""
            return f"no power after PowerOn: {describe()} {words}".strip()
    load = [settings.load]
    if any(settings.load_center):
        load += [1e3 * c for c in settings.load_center]
    reply = yield Request(f"EnableRobot({','.join(f'{v:.6f}' for v in load)})")
    if isinstance(reply, Reply) and reply.error:
        why = "; ".join(alarms())
        return f"EnableRobot: {reply.words}{f' ({why})' if why else ''}"
    for text in (
        "SpeedFactor(100)",
        "User(0)",
        "Tool(0)",
        f"SetCollisionLevel({settings.collision_level})",
        "Continue()",
    ):
        reply = yield Request(text)
        # An error of Continue is fine: firmware before 3.5.7 lacks it.
        if isinstance(reply, Reply) and reply.error and not text.startswith("Continue"):
            return f"{text}: {reply.words}"
    if not (yield WaitUntil(lambda: mode() == IDLE, IDLE_TIMEOUT)):
        return f"not idle after it was enabled: {describe()}"
    return ""


def disable_steps(
    firmware: Literal["v3", "v4"] | None,
    at_rest: Callable[[], bool],
    drives_off: Callable[[], bool],
    describe: Callable[[], str],
) -> SequenceSteps:
    """Yield the steps after which the arm rests without power; return the failure in words."""
    # An error is fine: whatever ran, the drives are disabled next.
    yield Request(STOP_COMMANDS[firmware or "v4"][0])
    yield WaitUntil(at_rest, REST_TIMEOUT)
    reply = yield Request(STOP_COMMANDS[firmware or "v4"][1])
    if not (yield WaitUntil(drives_off, DISABLE_TIMEOUT)):
        words = f", {reply.words}" if isinstance(reply, Reply) and reply.error else ""
        return f"still powered after DisableRobot: {describe()}{words}"
    return ""
