"""Files of browsers: bounded, and read one at a time in a thread of their own."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TypeVar

import viser

from dashboard.action_queue import ActionQueue
from dashboard.outbox import Notification
from shared.door import Door

Value = TypeVar("Value")

MAX_FILE_SIZE = 1 << 17
"""Largest file that is read [bytes]: a larger one keeps the interpreter from holds for too long."""


class Uploads:
    """Reader of the files that people upload; neither a step nor another click waits for it."""

    def __init__(self, actions: ActionQueue, notify: Callable[[Notification], None]) -> None:
        self._actions, self._notify = actions, notify
        self._door = Door()
        self._thread = ThreadPoolExecutor(1, "uploads")

    def take(
        self,
        file: viser.UploadedFile,
        kind: str,
        read: Callable[[bytes], Value],
        then: Callable[[Value], None],
    ) -> None:
        """Read a file of a kind, and act on it in the next step; say so if it is refused."""
        self._thread.submit(self._read, file, kind, read, then)

    def _read(
        self,
        file: viser.UploadedFile,
        kind: str,
        read: Callable[[bytes], Value],
        then: Callable[[Value], None],
    ) -> None:
        with self._door.guard("an uploaded file") as outcome:
            if len(file.content) > MAX_FILE_SIZE:
                raise ValueError(f"it is larger than {MAX_FILE_SIZE >> 10} KiB")
            self._actions.put(partial(then, read(file.content)))
        if outcome.refusal:
            refusal = Notification(f"{file.name}: not {kind}", outcome.refusal)
            self._actions.put(partial(self._notify, refusal))

    def close(self) -> None:
        """Read no further file."""
        self._thread.shutdown(wait=False, cancel_futures=True)
