"""Taichi runtime of a process, which is started here and nowhere else.

A second `ti.init` would destroy every compiled kernel.
"""

from __future__ import annotations

import contextlib
import functools
import io
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import taichi as ti
from jaxtyping import Float64, Int32
from taichi.lang import kernel_impl
from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext
from taichi.lang.impl import get_runtime

_started = False
"""Whether the runtime of this process has been started."""
_compiled: dict[Any, tuple[Any, Any]] = {}
"""Source and machine code of each kernel that has been launched."""


def start(*, writes_assembly: bool = False) -> None:
    """Start Taichi on the CPU in double precision, once; further calls do nothing.

    Args:
        writes_assembly: Whether Taichi writes the assembly of its kernels into the current folder.
    """
    global _started
    if not _started:
        _skip_source_positions()
        keeps_kernels = _has_cache_folder()
        # Nothing is kept there, but Taichi crashes without a folder.
        elsewhere = {} if keeps_kernels else {"offline_cache_file_path": tempfile.gettempdir()}
        # Taichi prints that it starts, into results and progress bars.
        with contextlib.redirect_stdout(io.StringIO()):
            ti.init(
                arch=ti.cpu,
                default_fp=ti.f64,
                cpu_max_num_threads=1,
                # Kernels from the cache are not compiled, and yield no assembly.
                offline_cache=keeps_kernels and not writes_assembly,
                print_kernel_asm=writes_assembly,
                # LLVM optimizes anyway. Without Taichi's own passes the rod compiles in a quarter
                # of the time and runs 5 % slower.
                advanced_optimization=False,
                log_level=ti.WARN,
                **elsewhere,
            )
        _started = True


def launch(
    kernel: Any, arrays: Sequence[Int32[np.ndarray, "k"] | Float64[np.ndarray, "m *e"]], count: int
) -> None:
    """Launch a kernel; the first launch compiles it, later ones bypass Taichi's checks.

    Taichi's own call inspects each argument, which takes as long as a step of a rod of ten nodes.

    Args:
        kernel: Kernel of these arrays and a number.
        arrays: Sizes, offsets and indices, then inputs and results, as in `layout`; elements of an
            array are numbers or matrices.
        count: Number of rods.
    """
    compiled = _compiled.get(kernel)
    program: Any = get_runtime().prog
    if compiled is None:
        kernel(*arrays, count)
        source = next(iter(kernel._primal.compiled_kernels.values()))
        binary = program.compile_kernel(program.config(), program.get_device_caps(), source)
        _compiled[kernel] = source, binary
        return
    source, binary = compiled
    context = source.make_launch_context()
    for place, array in enumerate(arrays):
        context.set_arg_external_array_with_shape(
            (place,), array.ctypes.data, array.nbytes, array.shape[:1], 0
        )
    context.set_arg_int((len(arrays),), count)
    program.launch_kernel(binary, context)


def _has_cache_folder() -> bool:
    """Return whether the folder in which Taichi keeps its kernels can be written."""
    folder = Path.home() / ".cache" / "taichi"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


def _skip_source_positions() -> None:
    """Skip work that Taichi does for error messages alone, at every start, cached or not.

    It formats the source position of every expression of a kernel, and reads and splits the source
    of an inlined function at every call of it: two thirds of the time of a cached start.
    """
    ASTTransformerContext.get_pos_info = lambda self, node: ""
    kernel_impl.getsourcelines = functools.cache(kernel_impl.getsourcelines)
