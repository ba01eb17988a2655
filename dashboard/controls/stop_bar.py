"""Stop bar: holds the arms and keeps an approach going, independent of the rest of the page."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from concurrent.futures import Future
from typing import NamedTuple

import msgspec

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.controls import status_text
from dashboard.controls.first_steps import FirstStep
from dashboard.controls.hold_path import HoldPath, is_stopped
from dashboard.outbox import Outbox
from dashboard.subscriptions import STALE_AGE
from dashboard.web.cell_socket import Approach, HoldAnswer
from lariat.trajectory import SECOND
from shared.messages import ArmCommand, ArmStates

STATUS_PERIOD = SECOND // 5
"""Time between two statuses [ns]."""
MAX_SIGN_GAP = 150_000_000
"""Longest time between two signs of life of one press [ns]; after it the press has ended."""
ENDED_PRESSES = 64
"""Number of ended presses that are remembered [-]."""


class _Press(NamedTuple):
    """Press of the approach's button."""

    number: int
    """Number that the browser has chosen."""
    command: str
    """Id of its APPROACH."""
    sign_time: int
    """Time of its last sign of life [ns]."""


class StopBar:
    """State of the stop bar of all pages.

    `hold`, `approach` and `release` may be called in any thread.
    """

    def __init__(self, outbox: Outbox, holds: HoldPath) -> None:
        self._outbox, self._holds = outbox, holds
        self._actions = ActionQueue()
        self._now = 0
        self._newest: ArmStates | None = None
        self._press: _Press | None = None
        self._ended: deque[int] = deque([0], maxlen=ENDED_PRESSES)
        self._consented = False
        self._status_time = -STATUS_PERIOD

    def hold(self) -> Future[HoldAnswer]:
        """Stop the arms; the future is completed when the gateway has confirmed it."""
        answer = self._holds.hold()
        if press := self._press:
            self.release(press.number)
        return answer

    def approach(self, sign: Approach) -> None:
        """Take a sign of life: the first of a press requests the approach, the others consent."""
        self._actions.put(lambda: self._take_sign(sign))

    def release(self, press: int) -> None:
        """End a press; signs of it that are still queued, or come later, count for nothing."""
        self._ended.append(press)
        self._actions.put(lambda: self._end(press))

    def step(
        self,
        newest: ArmStates | None,
        age: float,
        now: int,
        silent: str = "",
        steps: Sequence[FirstStep] = (),
        activity: str = "",
    ) -> str | None:
        """Do what people asked for, and return the bar's new status when it is due."""
        self._now, self._newest = now, newest
        self._holds.newest = newest or ArmStates()
        self._actions.run()
        if self._consented and self._press and newest and self._press.number not in self._ended:
            self._outbox.consent(self._press.command, newest)
        self._consented = False
        if self._press and self._now - self._press.sign_time > MAX_SIGN_GAP:
            self._end(self._press.number)
        if self._now - self._status_time < STATUS_PERIOD:
            return None
        self._status_time = self._now
        line = status_text.gateway_status(newest, age)
        status = {
            "text": line.text,
            "detail": line.detail,
            "rule": line.rule,
            "color": palette.css(line.color),
            "stopped": newest is not None and age <= STALE_AGE and is_stopped(newest),
            "approach": _offer(newest),
            "ended": self._ended[-1],
            "silent": silent,
            "steps": steps,
            "activity": activity,
        }
        return msgspec.json.encode(status).decode()

    def _take_sign(self, sign: Approach) -> None:
        if self._newest is None or sign.press in self._ended:
            return
        if self._press is None:
            command = self._outbox.command_arms(
                ArmCommand.APPROACH,
                self._newest,
                "Approach",
                approach_distance=sign.distance,
                approach_angle=sign.angle,
            )
            self._press = _Press(sign.press, command, self._now)
        elif sign.press == self._press.number:
            if self._now - self._press.sign_time > MAX_SIGN_GAP:
                self._end(sign.press)
                return
            self._press = self._press._replace(sign_time=self._now)
            self._consented = True

    def _end(self, press: int) -> None:
        if self._press is not None and self._press.number == press:
            self._press = None
            self._ended.append(press)


def _offer(arms: ArmStates | None) -> dict[str, float | str] | None:
    """Approach that the gateway offers, for the button that names it."""
    if arms is None or not arms.needs_approach:
        return None
    distance = status_text.format_millimeters(arms.approach_distance)
    angle = math.degrees(arms.approach_angle)
    turn = f", {angle:.0f}°" if angle >= 1.0 else ""
    return {
        "label": f"Approach by {distance}{turn}",
        "distance": arms.approach_distance,
        "angle": arms.approach_angle,
    }
