"""Hold-to-run consent: signs of life of a person who holds a button to let the arms move.

A sign of life names the command that it keeps going and echoes a recent state, so that signs that
wait in a queue, or belong to another command, count for nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

from lariat.trajectory import NANOSECONDS

CONSENT_TIMEOUT = 0.08
"""Time after the last sign of life at which the arms brake [s]: an arm follows its command with a
delay and must begin to brake within 150 ms."""
MAX_ECHO_AGE = 0.15
"""Age of the echoed state above which a sign of life is stale [s]."""


@dataclass(frozen=True)
class SignOfLife:
    """Sign of life of the person who holds the button."""

    command: str
    """Id of the command that it keeps going."""
    boot: str
    """Id of the gateway's start."""
    sequence: int
    """Number, growing."""
    answers: int
    """Stamp of the newest state that the sender had [ns]."""


class HoldToRun:
    """Consent to one command, which ends with the signs of life."""

    def __init__(self, boot: str) -> None:
        """Create the consent to nothing. Args: boot: Id of this start of the gateway."""
        self._boot = boot
        self._command = ""
        self._sequence = -1
        self._last = 0

    def begin(self, command: str, now: int) -> None:
        """Begin the consent to a command, whose arrival at `now` [ns] is the first sign of life."""
        self._command, self._sequence, self._last = command, -1, now

    def bridge(self, now: int) -> None:
        """Count up to `now` [ns] as consent: the gateway could not hear signs of life meanwhile."""
        self._last = max(self._last, now)

    def take(self, sign: SignOfLife, now: int) -> None:
        """Take a sign of life that arrived at `now` [ns]; an invalid one has no effect."""
        fresh = 0.0 <= (now - sign.answers) * NANOSECONDS <= MAX_ECHO_AGE
        mine = sign.command == self._command and sign.boot == self._boot
        if mine and fresh and sign.sequence > self._sequence:
            self._sequence, self._last = sign.sequence, now

    def ended(self, now: int) -> bool:
        """Return whether the last sign of life is too old at `now` [ns]."""
        return (now - self._last) * NANOSECONDS > CONSENT_TIMEOUT
