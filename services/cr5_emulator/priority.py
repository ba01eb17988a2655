"""Scheduling priority of the emulator's process.

A real arm has its own computer. The emulator shares one with the stack, so it runs at a higher
priority where the system allows that.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

EMULATOR_NICENESS = -15
"""Scheduling priority of the emulator, nice(2)."""
AUTOGROUP_FILE = Path("/proc/self/autogroup")
"""Priority of the process's session on Linux, which may be applied before that of the process."""


@contextlib.contextmanager
def raised_priority() -> Iterator[None]:
    """Run the block at `EMULATOR_NICENESS`; the session's priority is restored afterwards."""
    with contextlib.suppress(PermissionError):
        os.setpriority(
            os.PRIO_PROCESS, 0, min(EMULATOR_NICENESS, os.getpriority(os.PRIO_PROCESS, 0))
        )
    before = None
    with contextlib.suppress(OSError, ValueError):
        before = int(AUTOGROUP_FILE.read_text().rpartition(" ")[2])
        AUTOGROUP_FILE.write_text(str(min(EMULATOR_NICENESS, before)))
    try:
        yield
    finally:
        if before is not None:
            with contextlib.suppress(OSError):
                AUTOGROUP_FILE.write_text(str(before))
