"""Versions of the installation, and of the formats that it reads and writes."""

from __future__ import annotations

import subprocess
from functools import cache
from importlib import metadata
from pathlib import Path

MESSAGE_VERSION = 2
"""Version of topics and messages; a reader refuses messages of a newer version."""
RECORDING_VERSION = 2
"""Version of recordings: metadata, attachments and channels; 0 stands for files without one.

Readers of version 1 take messages as they are stored, and would misorder the beginning of a run."""


@cache
def version() -> str:
    """Return the installed version."""
    return metadata.version("lariat")


@cache
def commit() -> str:
    """Return the commit of a clone, with "-dirty" after local changes; empty outside of one."""
    folder = Path(__file__).parent
    try:
        answer = subprocess.run(
            ["git", "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"],
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=5.0,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return answer.stdout.strip()
