"""Sync of a file with its disk, in a thread: a busy disk takes seconds."""

from __future__ import annotations

import os
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path


class DiskSync:
    """Thread that has the disk store what the operating system holds of one file."""

    def __init__(self, descriptor: int, folder: Path) -> None:
        """Start the thread; the name of the file is stored first."""
        # A descriptor of its own: the last sync outlives the writer's file.
        self._descriptor = os.dup(descriptor)
        self._executor = ThreadPoolExecutor(1, thread_name_prefix="disk sync")
        self._pending: Future[None] = self._executor.submit(_sync_folder, folder)

    def request(self) -> None:
        """Begin to sync, unless the former sync is still under way.

        Raises:
            OSError: The former sync failed.
        """
        if self._pending.done():
            self._pending.result()
            self._pending = self._executor.submit(os.fdatasync, self._descriptor)

    def close(self) -> None:
        """Have the thread sync the whole file and end; the process waits for it at its exit."""
        self._executor.submit(self._finish)
        self._executor.shutdown(wait=False)

    def _finish(self) -> None:
        try:
            os.fdatasync(self._descriptor)
        finally:
            os.close(self._descriptor)


def _sync_folder(folder: Path) -> None:
    """Have the disk store the names of a folder's files, where the system can."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
