"""How a CR5 is made ready: alarms cleared, power on, enabled, settings restored, no old motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from services.robot_gateway.drivers.cr5.command_sequence import Request, Steps, Until
from services.robot_gateway.drivers.cr5.replies import Reply
from shared.cr5.alarms import FOLLOWING

POWER_TIME = 20.0
"""From PowerOn until the arm can be enabled; the maker speaks of 10 s."""
IDLE_TIME = 3.0
"""From the last setting until the arm says that it is idle."""
STARTING, NO_POWER, GUIDED, IN_ALARM = 1, 3, 6, 9


@dataclass(frozen=True)
class Settings:
    """What an arm is told each time that it is enabled."""

    load: float = 0.0
    """On the flange [kg]."""
    load_center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Of that mass in the flange's frame [m]."""
    collision_level: int = 3
    """0 (off) to 5 (most sensitive)."""


def make_ready(
    firmware: Literal["v3", "v4"] | None,
    mode: Callable[[], int | None],
    describe: Callable[[], str],
    alarms: Callable[[], tuple[str, ...]],
    settings: Settings,
) -> Steps:
    """The steps to an arm that follows servo points.

    Args:
        mode: RobotMode as the arm says it now.
        describe: The same in words.
        alarms: What the arm has said to be wrong.
    """
    if firmware == "v4":
        # Older firmware does not know it, and it is refused while enabled: both are fine.
        yield Request("RequestControl()")
        yield Request("EmergencyStop(0)")
    if mode() not in FOLLOWING:
        yield Request("ClearError()")
    yield Request("ResetRobot()" if firmware == "v3" else "Stop()")
    if mode() == GUIDED:
        yield Request("StopDrag()")
    if mode() in (STARTING, NO_POWER, IN_ALARM):
        # On V3 this also resets a software emergency stop.
        reply = yield Request("PowerOn()")
        yield Until(lambda: False, 0.2)
        if not (yield Until(lambda: mode() in (4, *FOLLOWING), POWER_TIME)):
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
        # Continue is only known from 3.5.7 on, and there is nothing to continue.
        if isinstance(reply, Reply) and reply.error and not text.startswith("Continue"):
            return f"{text}: {reply.words}"
    if not (yield Until(lambda: mode() == 5, IDLE_TIME)):
        return f"not idle after it was enabled: {describe()}"
    return ""
