"""Command-line options of the recorder, beside those of every service."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class RecorderOptions:
    """Folder of the recordings, space to leave on its disk, and what is deleted."""

    folder: Path = Path("recordings")
    """Folder that receives one MCAP file for each run."""
    least_free: float = 0.5
    """Free space on the disk below which recording stops [GB]."""
    always: bool = False
    """Whether an idle cell is recorded like a run, with its images."""
    keep: float | None = None
    """Size of all recordings beyond which the oldest are deleted, those of idle cells first [GB];
    by default none is. The log names a file before it is deleted; runs with a star stay."""
