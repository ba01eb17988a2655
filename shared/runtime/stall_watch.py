"""Watch over the steps of a live service: a step that does not end is reported with its place."""

from __future__ import annotations

import logging
import sys
import threading
import time
import traceback
from collections.abc import Callable
from pathlib import Path

log = logging.getLogger(__name__)

POLL_PERIOD = 0.25
"""Time between two looks at the step [s]."""
MIN_STALL_TIME = 1.0
"""Duration of a step above which it is reported [s]."""
NAMED_FRAMES = 3
"""Number of innermost calls that a report names."""


class StallWatch:
    """Thread that reports the calls in which a step of the main thread is stuck.

    The step itself cannot report: code from outside of Lariat may never return.
    """

    def __init__(self, limit: float, report: Callable[[str], None]) -> None:
        """Watch the creating thread for steps longer than `limit` and `MIN_STALL_TIME` [s].

        `report` is called from the watching thread with what is stuck, once per step.
        """
        self._limit, self._report = max(limit, MIN_STALL_TIME), report
        self._watched = threading.get_ident()
        self._begun: float | None = None
        """Start of the present step [s]; None between steps."""
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="stall watch", daemon=True)
        self._thread.start()

    def step_begins(self) -> None:
        """Note that a step begins."""
        self._begun = time.monotonic()

    def step_ended(self) -> None:
        """Note that it has ended."""
        self._begun = None

    def close(self) -> None:
        """End the watch."""
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        reported: float | None = None
        while not self._ended.wait(POLL_PERIOD):
            begun = self._begun
            if begun is None or begun == reported or time.monotonic() - begun < self._limit:
                continue
            reported = begun
            self._report(
                f"a step has not ended for {time.monotonic() - begun:.1f} s: {self._where()}"
            )

    def _where(self) -> str:
        """Innermost calls of the watched thread, the innermost first."""
        frame = sys._current_frames().get(self._watched)
        calls = traceback.extract_stack(frame)[-NAMED_FRAMES:] if frame else []
        return ", called by ".join(
            f"{call.name} ({Path(call.filename).name}:{call.lineno})" for call in reversed(calls)
        )
