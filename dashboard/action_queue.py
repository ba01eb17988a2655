"""Queue that carries actions from the web server's threads into the thread that steps.

Callbacks of the web server only call `put`; every action runs in the thread that steps.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from queue import Empty, SimpleQueue

log = logging.getLogger(__name__)

Action = Callable[[], None]


class ActionQueue:
    """First-in, first-out queue of actions; `put` may be called in any thread."""

    def __init__(self) -> None:
        self._queue: SimpleQueue[Action] = SimpleQueue()

    def put(self, action: Action) -> None:
        """Append an action."""
        self._queue.put(action)

    def run(self) -> None:
        """Remove and run the actions that are queued now, oldest first.

        One that fails is logged and dropped: its arguments come from a browser, and no browser may
        end the process.
        """
        for _ in range(self._queue.qsize()):
            try:
                action = self._queue.get_nowait()
            except Empty:
                return
            try:
                action()
            except Exception:
                log.exception("an action of the page failed")
