"""What people do in their browsers, carried from the server's threads into the step.

Callbacks of the server only `put` here; everything is decided in the thread that steps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from queue import Empty, SimpleQueue

Action = Callable[[], None]


class Actions:
    """A queue of things to do."""

    def __init__(self) -> None:
        self._queue: SimpleQueue[Action] = SimpleQueue()

    def put(self, action: Action) -> None:
        """Called in any thread."""
        self._queue.put(action)

    def take(self) -> Iterator[Action]:
        """All that came so far, in order."""
        while True:
            try:
                yield self._queue.get_nowait()
            except Empty:
                return
