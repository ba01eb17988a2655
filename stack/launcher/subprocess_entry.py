"""Becomes another program, one that ends when its parent does.

    python -I -S child.py SIGNAL PARENT NICENESS PROGRAM [ARGUMENT...]

A launcher that is killed cannot tell its processes; the kernel can. Setting that up between fork
and exec is not safe in a process with threads, so it happens here, in a program of its own that
imports next to nothing.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys

PR_SET_PDEATHSIG = 1
AUTOGROUP = "/proc/self/autogroup"


def main() -> None:
    """Never returns."""
    number, parent, niceness, *program = sys.argv[1:]
    if sys.platform == "linux":
        # It outlives exec.
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, int(number), 0, 0, 0)
    # The parent may have died before the kernel knew whom to tell.
    if os.getppid() != int(parent):
        sys.exit(f"{program[0]}: the launcher {parent} is gone")
    # Only root may go before others; the stack must run without that.
    with contextlib.suppress(PermissionError):
        os.nice(int(niceness))
    # Linux may share its cores out between sessions first, and this process leads one of its own:
    # its niceness then counts only against itself, and that of the session counts instead.
    with contextlib.suppress(OSError), open(AUTOGROUP, "w") as session:
        session.write(niceness)
    os.execv(program[0], program)


if __name__ == "__main__":
    main()
