"""Retention of recordings: the oldest are deleted before their folder grows beyond a size."""

from __future__ import annotations

import logging
import re
from pathlib import Path

log = logging.getLogger(__name__)

IDLE_ENDING = "_idle.mcap"
"""End of the names of recordings of an idle cell."""
_NAME = re.compile(r"\d{4}-\d\d-\d\d_\d\d-\d\d-\d\d_.*\.mcap")
"""Names of the files that the recorder writes; no other file is deleted."""


def delete_oldest(folder: Path, max_size: float) -> list[Path]:
    """Delete the oldest recordings of a folder, idle cells first, until the rest is small enough.

    Args:
        folder: Folder of the recordings.
        max_size: Largest size of the recordings that stay, all together [bytes].

    Raises:
        OSError: A file cannot be deleted.
    """
    files = {p: p.stat().st_size for p in folder.iterdir() if _NAME.fullmatch(p.name)}
    total = sum(files.values())
    deleted = []
    # A name begins with the time of the file's first message.
    for path in sorted(files, key=lambda path: (not path.name.endswith(IDLE_ENDING), path.name)):
        if total <= max_size:
            break
        path.unlink()
        total -= files[path]
        deleted.append(path)
        log.warning("deleted %s: recordings take up to %.3g GB", path, max_size / 1e9)
    return deleted
