"""The one owner of the Taichi runtime of a process.

A second `ti.init` destroys every compiled kernel, so nobody else may call it.
"""

from __future__ import annotations

import contextlib
import functools
import sys
from typing import Any

import numpy as np
import taichi as ti
from jaxtyping import Float64, Int32
from taichi.lang import kernel_impl
from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext
from taichi.lang.impl import get_runtime

_started = False
_compiled: dict[Any, tuple[Any, Any]] = {}


def start(*, writes_assembly: bool = False) -> None:
    """Start Taichi on the CPU in double precision, once; further calls do nothing.

    Args:
        writes_assembly: Whether it writes what it compiles into the working folder, as assembly.
    """
    global _started
    if not _started:
        _hasten()
        # Taichi announces itself on standard output, where a program's answer belongs.
        with contextlib.redirect_stdout(sys.stderr):
            ti.init(
                arch=ti.cpu,
                default_fp=ti.f64,
                cpu_max_num_threads=1,
                # What comes from there has been assembled already.
                offline_cache=not writes_assembly,
                print_kernel_asm=writes_assembly,
                # LLVM optimises as well; without Taichi's own passes the rod compiles in a quarter
                # of the time and runs 5 % slower.
                advanced_optimization=False,
                log_level=ti.WARN,
            )
        _started = True


def launch(
    kernel: Any,
    integers: Int32[np.ndarray, "k"],
    doubles: Float64[np.ndarray, "m"],
    count: int,
) -> None:
    """A kernel of two arrays and a count; the first launch compiles, others go straight to it.

    Taichi's own call looks at each argument anew, for as long as a rod of ten nodes takes a step.
    """
    compiled = _compiled.get(kernel)
    program: Any = get_runtime().prog
    if compiled is None:
        kernel(integers, doubles, count)
        source = next(iter(kernel._primal.compiled_kernels.values()))
        binary = program.compile_kernel(program.config(), program.get_device_caps(), source)
        _compiled[kernel] = source, binary
        return
    source, binary = compiled
    context = source.make_launch_context()
    for place, array in enumerate((integers, doubles)):
        context.set_arg_external_array_with_shape(
            (place,), array.ctypes.data, array.nbytes, array.shape, 0
        )
    context.set_arg_int((2,), count)
    program.launch_kernel(binary, context)


def _hasten() -> None:
    """Leave out what Taichi does for error messages alone, at every start, cached or not.

    It words the place of every expression of a kernel as text, and reads and splits the source of
    an inlined function anew at every call of it: together two thirds of what a cached start costs.
    """
    ASTTransformerContext.get_pos_info = lambda self, node: ""
    kernel_impl.getsourcelines = functools.cache(kernel_impl.getsourcelines)
