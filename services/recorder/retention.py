"""Retention of recordings: where a person limits their size, the oldest are deleted."""

from __future__ import annotations

import logging
import os
import re
import shutil
import stat
from contextlib import suppress
from pathlib import Path

from lariat.configuration import ConfigurationError
from services.recorder.runs.run_folder import recordings_of_runs

log = logging.getLogger(__name__)

IDLE_ENDING = "_idle.mcap"
"""End of the names of recordings of an idle cell."""
_NAME = re.compile(r"\d{4}-\d\d-\d\d_\d\d-\d\d-\d\d_.*\.mcap")
"""Names of the files that the recorder writes; no other file is counted or deleted."""


class Retention:
    """Retention of the recordings of one folder: a file is announced before it is deleted."""

    def __init__(self, folder: Path, max_size: float | None) -> None:
        """Announce and delete nothing yet; without a largest size [bytes] all is kept."""
        if max_size is not None and not max_size > 0.0:
            raise ConfigurationError(f"--keep must be positive, got {max_size / 1e9:g} GB")
        self._folder, self._max_size = folder, max_size
        self._announced: set[Path] = set()

    def apply(self) -> None:
        """Delete what the last call has announced, and announce what the next one deletes.

        Of the files beyond the size, those of idle cells go first, then the oldest; recordings of
        runs with a star stay. What cannot be deleted stays, too.
        """
        if self._max_size is None:
            return
        surplus = self._surplus(self._max_size)
        for path in [path for path in surplus if path in self._announced]:
            try:
                path.unlink()
            except OSError as error:
                log.warning("cannot delete %s: %s", path, error.strerror)
                continue
            log.warning("deleted %s", path)
        new = [path for path in surplus if path not in self._announced]
        if new:
            log.warning(
                "recordings take more than --keep %g GB; when the next file begins, %d are "
                "deleted unless a star or a larger --keep keeps them: %s",
                self._max_size / 1e9,
                len(new),
                ", ".join(path.name for path in new),
            )
        self._announced = set(new)

    def _surplus(self, max_size: float) -> list[Path]:
        """Return the files that have to go so that the rest is small enough."""
        files = recordings(self._folder)
        total = sum(files.values())
        if total <= max_size:
            return []
        starred = recordings_of_runs(self._folder, starred=True)
        surplus = []
        for path in sorted(files, key=_age_rank):
            if total <= max_size:
                break
            if path.name not in starred:
                surplus.append(path)
                total -= files[path]
        return surplus


def space(folder: Path) -> tuple[int, int]:
    """Return the size of the recordings of a folder, and the free space of its disk [bytes]."""
    with suppress(OSError):
        return sum(recordings(folder).values()), shutil.disk_usage(folder).free
    return 0, 0


def recordings(folder: Path) -> dict[Path, int]:
    """Return the sizes of the recorder's own files in a folder [bytes]; links are none of them."""
    sizes: dict[Path, int] = {}
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if not _NAME.fullmatch(entry.name):
                continue
            # It may have been deleted a moment ago.
            with suppress(OSError):
                status = entry.stat(follow_symlinks=False)
                if stat.S_ISREG(status.st_mode):
                    sizes[Path(entry.path)] = status.st_size
    return sizes


def _age_rank(path: Path) -> tuple[bool, str]:
    """Rank of a file: those of idle cells first; a name begins with the time of its begin."""
    return not path.name.endswith(IDLE_ENDING), path.name
