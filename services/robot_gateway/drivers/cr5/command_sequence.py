"""Sequence of requests to the arm: a generator that is advanced over many ticks."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass

from lariat.trajectory import SECOND
from services.robot_gateway.drivers.cr5.replies import Reply


@dataclass(frozen=True)
class Request:
    """Step that sends a command and waits for its reply."""

    text: str
    """The command."""


@dataclass(frozen=True)
class WaitUntil:
    """Step that waits for a condition, up to a time limit."""

    condition: Callable[[], bool]
    """Condition, evaluated at every tick."""
    seconds: float
    """Time limit [s]."""


SequenceSteps = Generator[Request | WaitUntil, Reply | bool, str]
"""Generator that yields steps, receives their outcomes, and returns the failure in words if any."""


class CommandSequence:
    """Runs one sequence at a time."""

    def __init__(self, send: Callable[[str], None]) -> None:
        """Args: send: Sends a command; its reply is passed to `answer` when it arrives."""
        self._send = send
        self._steps: SequenceSteps | None = None
        self._step: Request | WaitUntil | None = None
        self._since = 0
        self._answer: Reply | None = None
        self.failure = ""
        """Why the last sequence failed, in words."""

    @property
    def running(self) -> bool:
        """Whether a sequence runs."""
        return self._steps is not None

    def begin(self, steps: SequenceSteps) -> None:
        """Start a sequence; one that runs is discarded."""
        self._steps, self._step, self._answer = steps, None, None

    def stop(self, why: str = "") -> None:
        """Discard the sequence that runs, which fails with the reason `why`."""
        if self.running:
            self.failure = why or self.failure
        self._steps = self._step = self._answer = None

    def answer(self, reply: Reply) -> None:
        """Take a reply of the arm; replies to other commands are ignored."""
        if isinstance(self._step, Request) and reply.answers(self._step.text):
            self._answer = reply

    def advance(self, now: int) -> None:
        """Take the next step if the present one is done. Args: now: [ns]."""
        if self._steps is None:
            return
        try:
            if self._step is None:
                self._start_step(next(self._steps), now)
            elif isinstance(self._step, Request) and self._answer is not None:
                reply, self._answer = self._answer, None
                self._start_step(self._steps.send(reply), now)
            elif isinstance(self._step, WaitUntil):
                if self._step.condition():
                    self._start_step(self._steps.send(True), now)
                elif now - self._since > self._step.seconds * SECOND:
                    self._start_step(self._steps.send(False), now)
        except StopIteration as stop:
            self._steps = self._step = None
            self.failure = stop.value or ""

    def _start_step(self, step: Request | WaitUntil, now: int) -> None:
        self._step, self._since = step, now
        if isinstance(step, Request):
            self._answer = None
            self._send(step.text)
