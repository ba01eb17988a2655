"""Command-line options of the recorder, beside those of every service."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class RecorderOptions:
    """Folder of the recordings, and space to leave on its disk."""

    folder: Path = Path("recordings")
    """Folder that receives one MCAP file for each run."""
    least_free: float = 0.5
    """Free space on the disk below which recording stops [GB]."""
