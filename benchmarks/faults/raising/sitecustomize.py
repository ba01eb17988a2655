"""An exception in the main thread of a process at SIGUSR1, wherever it is at that moment.

Python imports a module of this name at its start, where `PYTHONPATH` names this folder.
"""

from __future__ import annotations

import signal
from types import FrameType


class InjectedError(RuntimeError):
    """Error that no code expects."""


def _raise(number: int, frame: FrameType | None) -> None:
    raise InjectedError("raised by `lariat bench faults`")


signal.signal(signal.SIGUSR1, _raise)
