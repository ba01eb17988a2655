"""The one owner of the Taichi runtime of a process.

A second `ti.init` destroys every compiled kernel, so nobody else may call it.
"""

from __future__ import annotations

import contextlib
import sys

import taichi as ti

_started = False


def start() -> None:
    """Start Taichi on the CPU in double precision, once; further calls do nothing."""
    global _started
    if not _started:
        # Taichi announces itself on standard output, where a program's answer belongs.
        with contextlib.redirect_stdout(sys.stderr):
            ti.init(
                arch=ti.cpu,
                default_fp=ti.f64,
                cpu_max_num_threads=1,
                offline_cache=True,
                # LLVM optimises as well; without Taichi's own passes the rod compiles in a quarter
                # of the time and runs 5 % slower.
                advanced_optimization=False,
                log_level=ti.WARN,
            )
        _started = True
