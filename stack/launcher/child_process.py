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
    # The setting survives exec.
    end_with(int(parent), int(number))
    set_niceness(int(niceness))
    os.execv(program[0], program)


def end_with(parent: int, number: int) -> None:
    """Let the kernel end this process when its parent dies; end it now if that has happened."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, int(number), 0, 0, 0)
    # The parent may have died before the line above.
    if os.getppid() != parent:
        sys.exit(f"{sys.argv[0]}: the launcher (process {parent}) is gone")


def set_niceness(niceness: int) -> None:
    """Set the priority of this process, which leads a session."""
    # Only root may lower a niceness; the stack must run without that.
    with contextlib.suppress(PermissionError):
        os.nice(niceness)
    # With autogroups, Linux divides its cores between sessions first: only the session's niceness
    # then counts against other processes.
    with contextlib.suppress(OSError), open(AUTOGROUP, "w") as session:
        session.write(str(niceness))


if __name__ == "__main__":
    main()
