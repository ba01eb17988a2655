"""Processor time of a process, as the kernel counts it."""

from __future__ import annotations

import os
from pathlib import Path

TICK = 1.0 / os.sysconf("SC_CLK_TCK")
"""Unit of the kernel's processor times [s]."""


def processor_times(pid: int | str) -> tuple[float, float]:
    """Return the processor times of a process and of its children that have ended [s].

    Args:
        pid: Id of the process, or `self`.

    Raises:
        OSError: There is no such process.
    """
    # The name, in parentheses, may hold anything; utime, stime, cutime, cstime: see proc(5).
    words = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    user, system, ended_user, ended_system = (int(word) for word in words[11:15])
    return TICK * (user + system), TICK * (ended_user + ended_system)
