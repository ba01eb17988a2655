"""Temporary folder that is removed even where its process is killed: the next one removes it.

A lock on the folder ends with the process that holds it, however that ends. Folders of the same
prefix whose lock is free have been left behind. The lock also keeps systemd-tmpfiles, which removes
what is old, from the folders of a cell that runs for weeks.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import tempfile
from pathlib import Path
from typing import Self

MARK = ".locked"
"""Name of the file that marks folders of this class: those of older versions have no lock."""


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
        self._lock = os.open(self.path, os.O_RDONLY | os.O_DIRECTORY)
        fcntl.flock(self._lock, fcntl.LOCK_EX)
        (self.path / MARK).touch()

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
    for mark in Path(tempfile.gettempdir()).glob(f"{prefix}*/{MARK}"):
        with contextlib.suppress(OSError):
            folder = os.open(mark.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
            try:
                if os.fstat(folder).st_uid == os.getuid():
                    fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    shutil.rmtree(mark.parent)
            finally:
                os.close(folder)
