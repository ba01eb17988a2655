"""Holds of all pages: sent and confirmed between the steps, so that nothing else delays them."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import NamedTuple

from dashboard.controls import status_text
from dashboard.web.cell_socket import HOLD_TIMEOUT, HoldAnswer
from shared import topics
from shared.messages import ArmCommand, ArmStates

STOPPED_MODES = (ArmStates.DISARMED, ArmStates.HOLDING, ArmStates.FAULT)
"""Modes in which the arms stand or brake; they stay so unless the gateway says `may_move`."""


class _Hold(NamedTuple):
    """Hold that waits for the gateway's confirmation."""

    command: str
    """Id of the command."""
    end: float
    """Time after which nobody waits any more, on the monotonic clock [s]."""
    answer: Future[HoldAnswer]
    """Answer to the person."""


class HoldPath:
    """Reflex that holds the arms: the web server's thread sends, the bus's thread confirms."""

    reads = topics.ARM_STATE
    writes = topics.ARM_COMMAND

    def __init__(self, session: str) -> None:
        self.newest = ArmStates()
        """Newest state of the gateway that a step has seen."""
        self._session = session
        self._send: Callable[[ArmCommand], None] | None = None
        self._heard = False
        """Whether a state of the gateway has come while a hold waited."""
        self._lock = threading.Lock()
        self._count = 0
        self._waiting: list[_Hold] = []

    def connect(self, send: Callable[[ArmCommand], None]) -> None:
        """Take the function that stamps and sends a command; send what waits for it."""
        with self._lock:
            self._send = send
            waiting = [hold for hold in self._waiting if time.monotonic() < hold.end]
        for hold in waiting:
            self._request(send, hold.command)

    @property
    def waits(self) -> bool:
        """Whether a hold has not been confirmed yet."""
        return bool(self._waiting)

    def hold(self) -> Future[HoldAnswer]:
        """Stop the arms; the future is completed when the gateway has confirmed it."""
        answer: Future[HoldAnswer] = Future()
        now = time.monotonic()
        with self._lock:
            self._count += 1
            command = f"{self._session}-hold-{self._count}"
            self._waiting = [hold for hold in self._waiting if now < hold.end]
            self._waiting.append(_Hold(command, now + HOLD_TIMEOUT, answer))
            # One that comes before the process has joined the bus waits for that.
            send = self._send
        if send is not None:
            self._request(send, command)
        return answer

    def _request(self, send: Callable[[ArmCommand], None], command: str) -> None:
        # The gateway obeys a hold whatever it answers, so it is sent before its first state too.
        seen = self.newest
        send(ArmCommand(id=command, action=ArmCommand.HOLD, boot=seen.boot, answers=seen.stamp))

    def take(self, state: ArmStates) -> None:
        """Answer the holds that a state of the gateway confirms or refuses."""
        with self._lock:
            first, self._heard = not self._heard, True
            waiting, self._waiting = self._waiting, []
            for hold in waiting:
                answer = _confirmation(hold, state)
                if answer is None:
                    self._waiting.append(hold)
                # Its reader may have given up in the meantime.
                elif hold.answer.set_running_or_notify_cancel():
                    hold.answer.set_result(answer)
            # What was sent before the gateway and this process knew each other is lost; what comes
            # twice counts once.
            if first and self._send is not None:
                for hold in self._waiting:
                    self._request(self._send, hold.command)


def is_stopped(state: ArmStates) -> bool:
    """Return whether the arms stand or brake, and stay so until a person acts."""
    stands = state.mode in STOPPED_MODES or state.needs_resume
    return stands and not state.may_move and not state.approaching


def _confirmation(hold: _Hold, state: ArmStates) -> HoldAnswer | None:
    """Answer that a state of the gateway gives to a hold; None if it gives none."""
    line = status_text.gateway_status(state, 0.0)
    if state.last_command == hold.command:
        return HoldAnswer(not state.refusal, state.refusal or line.text)
    return HoldAnswer(True, line.text) if is_stopped(state) else None
