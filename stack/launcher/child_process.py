"""Entry of a child process: replaces itself by a program that ends when its parent does.

    python -I -S child_process.py SIGNAL PARENT NICENESS PROGRAM [ARGUMENT...]

A launcher that is killed cannot end its processes; the kernel can (Linux, prctl(2)). Setting that
up between fork and exec is unsafe in a process with threads, so a program of its own does it, which
imports next to nothing.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys

PR_SET_PDEATHSIG = 1
"""Option of prctl(2): signal sent to this process when its parent dies."""
AUTOGROUP = "/proc/self/autogroup"
"""File that sets the niceness of a whole session, sched(7)."""


def main() -> None:
    """Replace this process by the program on the command line; never returns."""
    number, parent, niceness, *program = sys.argv[1:]
    if sys.platform == "linux":
        # The setting survives exec.
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, int(number), 0, 0, 0)
    # The parent may have died before the line above.
    if os.getppid() != int(parent):
        sys.exit(f"{program[0]}: the launcher (process {parent}) is gone")
    # Only root may lower a niceness; the stack must run without that.
    with contextlib.suppress(PermissionError):
        os.nice(int(niceness))
    # With autogroups, Linux divides its cores between sessions first, and this process leads a
    # session of its own: only the session's niceness then counts against other processes.
    with contextlib.suppress(OSError), open(AUTOGROUP, "w") as session:
        session.write(niceness)
    os.execv(program[0], program)


if __name__ == "__main__":
    main()
