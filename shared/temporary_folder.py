"""Temporary folder that is removed even where its process is killed: the next one removes it.

A lock on a file of the folder ends with the process that holds it, however that ends. Folders of
the same prefix whose lock is free have been left behind.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import tempfile
import time
from pathlib import Path
from typing import Self

LOCK_FILE = ".owned"
"""Name of the locked file."""
YOUNGEST_LEFT = 10.0
"""Age below which a folder is not removed [s]: its process may be about to lock it."""


class TemporaryFolder:
    """Folder in the system's temporary one, for its owner alone (mode 0700)."""

    def __init__(self, prefix: str) -> None:
        """Create the folder, and remove those that killed processes of this user have left.

        Args:
            prefix: Start of its name, which only folders of this class have.
        """
        _remove_left(prefix)
        self.path = Path(tempfile.mkdtemp(prefix=prefix))
        """The folder."""
        self._lock = os.open(self.path / LOCK_FILE, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
        fcntl.flock(self._lock, fcntl.LOCK_EX)

    def remove(self) -> None:
        """Remove the folder and all that is in it; nothing happens the second time."""
        if self._lock >= 0:
            shutil.rmtree(self.path, ignore_errors=True)
            os.close(self._lock)
            self._lock = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.remove()


def _remove_left(prefix: str) -> None:
    """Remove the folders of a prefix whose process has ended."""
    for lock in Path(tempfile.gettempdir()).glob(f"{prefix}*/{LOCK_FILE}"):
        with contextlib.suppress(OSError):
            status = lock.parent.lstat()
            if status.st_uid != os.getuid() or time.time() - status.st_mtime < YOUNGEST_LEFT:
                continue
            descriptor = os.open(lock, os.O_RDWR | os.O_NOFOLLOW)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(lock.parent)
            finally:
                os.close(descriptor)
