"""What the recorder takes on its command line."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class RecorderOptions:
    """Where recordings go."""

    folder: Path = Path("recordings")
    """Holds one MCAP file for each run."""
    least_free: float = 0.5
    """Recording stops when less than this is left on the disk [GB]."""
