"""Queue that carries actions from the web server's threads into the thread that steps.

Callbacks of the web server only call `put`; every action runs in the thread that steps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from queue import Empty, SimpleQueue

Action = Callable[[], None]


class ActionQueue:
    """First-in, first-out queue of actions; `put` may be called in any thread."""

    def __init__(self) -> None:
        self._queue: SimpleQueue[Action] = SimpleQueue()

    def put(self, action: Action) -> None:
        """Append an action."""
        self._queue.put(action)

    def take(self) -> Iterator[Action]:
        """Remove and yield all queued actions, oldest first."""
        while True:
            try:
                yield self._queue.get_nowait()
            except Empty:
                return
