"""Sync of a file with its disk, in a thread: a disk may take seconds, the writer must not wait."""

from __future__ import annotations

import os
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path


class DiskSync:
    """Thread that has the disk store what the operating system holds of one file."""

    def __init__(self, descriptor: int) -> None:
        """Start the thread.

        Args:
            descriptor: Open file descriptor, which must stay open until `close`.
        """
        self._descriptor = descriptor
        self._executor = ThreadPoolExecutor(1, thread_name_prefix="disk sync")
        self._pending: Future[None] | None = None

    def request(self) -> None:
        """Begin to sync, unless the former sync is still under way.

        Raises:
            OSError: The former sync failed.
        """
        if self._pending is not None:
            if not self._pending.done():
                return
            self._pending.result()
        self._pending = self._executor.submit(os.fdatasync, self._descriptor)

    def close(self) -> None:
        """Wait for the disk to store the whole file, and end the thread.

        Raises:
            OSError: The disk is full or gone.
        """
        self._executor.shutdown()
        os.fdatasync(self._descriptor)


def sync_folder(folder: Path) -> None:
    """Have the disk store the names of a folder's files, where the system can."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
