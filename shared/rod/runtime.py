"""The one owner of the Taichi runtime of a process.

A second `ti.init` destroys every compiled kernel, so nobody else may call it.
"""

from __future__ import annotations

import contextlib
import functools
import sys

import taichi as ti
from taichi.lang import kernel_impl
from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext

_started = False


def start() -> None:
    """Start Taichi on the CPU in double precision, once; further calls do nothing."""
    global _started
    if not _started:
        _hasten()
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


def _hasten() -> None:
    """Leave out what Taichi does for error messages alone, at every start, cached or not.

    It words the place of every expression of a kernel as text, and reads and splits the source of
    an inlined function anew at every call of it: together two thirds of what a cached start costs.
    """
    ASTTransformerContext.get_pos_info = lambda self, node: ""
    kernel_impl.getsourcelines = functools.cache(kernel_impl.getsourcelines)
