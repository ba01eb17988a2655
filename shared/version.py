"""Versions: of the installation, and of what it reads and writes."""

from __future__ import annotations

import subprocess
from functools import cache
from importlib import metadata
from pathlib import Path

MESSAGE_VERSION = 1
"""Version of topics and messages. A reader refuses messages of a newer one."""
RECORDING_VERSION = 1
"""Version of recordings: their metadata, attachments and channels. 0: written without a version."""
SCENARIO_VERSION = 1
"""Version of the keys of scenario files."""


@cache
def version() -> str:
    """Return the installed version of the stack."""
    return metadata.version("lariat-stack")


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
