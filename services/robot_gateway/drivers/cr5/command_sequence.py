"""What takes several requests: a generator that is worked off over many ticks."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass

from services.robot_gateway.drivers.cr5.replies import Reply

SECOND = 1_000_000_000


@dataclass(frozen=True)
class Request:
    """A step: a command whose answer is waited for."""

    text: str


@dataclass(frozen=True)
class Until:
    """A step: a condition that comes true in time, or not."""

    condition: Callable[[], bool]
    seconds: float


Steps = Generator[Request | Until, Reply | bool, str]
"""Yields steps, is sent their outcome, and returns what went wrong in words, or nothing."""


class Procedure:
    """Works one off at a time."""

    def __init__(self, ask: Callable[[str], None]) -> None:
        """Args: ask: Sends a request, whose answer is handed to `answer` when it comes."""
        self._ask = ask
        self._steps: Steps | None = None
        self._step: Request | Until | None = None
        self._since = 0
        self._answer: Reply | None = None
        self.failure = ""
        """Why the last one failed, in words."""

    @property
    def running(self) -> bool:
        """Whether one is under way."""
        return self._steps is not None

    def begin(self, steps: Steps) -> None:
        """Begins one; another that is under way is forgotten."""
        self._steps, self._step, self._answer = steps, None, None

    def stop(self, why: str = "") -> None:
        """Forgets the one that is under way, which fails by `why`."""
        if self.running:
            self.failure = why or self.failure
        self._steps = self._step = self._answer = None

    def answer(self, reply: Reply) -> None:
        """An answer of the arm; one to somebody else's request is passed over."""
        if isinstance(self._step, Request) and reply.answers(self._step.text):
            self._answer = reply

    def advance(self, now: int) -> None:
        """Takes the next step when the present one has its outcome [ns]."""
        if self._steps is None:
            return
        try:
            if self._step is None:
                self._take(next(self._steps), now)
            elif isinstance(self._step, Request) and self._answer is not None:
                reply, self._answer = self._answer, None
                self._take(self._steps.send(reply), now)
            elif isinstance(self._step, Until):
                if self._step.condition():
                    self._take(self._steps.send(True), now)
                elif now - self._since > self._step.seconds * SECOND:
                    self._take(self._steps.send(False), now)
        except StopIteration as stop:
            self._steps = self._step = None
            self.failure = stop.value or ""

    def _take(self, step: Request | Until, now: int) -> None:
        self._step, self._since = step, now
        if isinstance(step, Request):
            self._answer = None
            self._ask(step.text)
