"""Key of the terminal that a person holds down, as a hold-to-run button."""

from __future__ import annotations

import os
import select
import sys
import termios
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager

REPEAT_DELAY = 0.8
"""Longest time from the key's press to its first repetition by the terminal [s]."""
REPEAT_PERIOD = 0.12
"""Longest time between two later repetitions [s]; release is noticed this much later."""


class HeldKey:
    """Any key, as long as the terminal repeats it."""

    def __init__(self, descriptor: int) -> None:
        """Create the state of a key that is not pressed yet. Args: descriptor: Of the terminal."""
        self._descriptor = descriptor
        self._presses = 0
        self._last = 0.0

    def __call__(self) -> bool:
        """Return whether the key is held down."""
        now = time.monotonic()
        while select.select([self._descriptor], [], [], 0.0)[0]:
            if not os.read(self._descriptor, 1024):
                return False
            self._presses, self._last = self._presses + 1, now
        limit = REPEAT_DELAY if self._presses == 1 else REPEAT_PERIOD
        return self._presses > 0 and now - self._last <= limit

    def wait(self) -> None:
        """Wait until the key is pressed, or pressed again."""
        self._presses = 0
        select.select([self._descriptor], [], [])
        self()


@contextmanager
def held_key() -> Iterator[HeldKey]:
    """Read keys without echo for the duration of a `with` block."""
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    try:
        tty.setcbreak(descriptor)
        yield HeldKey(descriptor)
    finally:
        termios.tcsetattr(descriptor, termios.TCSAFLUSH, before)
