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
from typing import Any, Literal

import numpy as np
from jaxtyping import Float64, Int32

from lariat.machine_code.kernel_key import NoCompilerError

try:
    import taichi as ti
    from taichi.lang import kernel_impl, misc
    from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext
    from taichi.lang.impl import get_runtime
except ModuleNotFoundError as error:
    raise NoCompilerError(
        "Taichi is not installed, and no machine code of this kernel is kept for this processor: "
        "build the container images on this machine (docker compose build), that of the paper's "
        "controller with TORCH; elsewhere, pip install taichi"
    ) from error

Device = Literal["cpu", "cuda"]
"""Device of the runtime."""
CUDA_STACK = 16384
"""Stack of a thread on CUDA [bytes]; the rod's real functions take 8 kB of it on an x86."""

_started: Device | None = None
"""Device of the runtime of this process; None before it starts."""
_compiled: dict[Any, tuple[Any, Any]] = {}
"""Source and machine code of each kernel that has been launched."""


def start(
    device: Device = "cpu", *, threads: int | None = 1, writes_assembly: bool = False
) -> None:
    """Start Taichi in double precision, once; further calls do nothing.

    Args:
        device: Device of all kernels of this process.
        threads: Number of threads of parallel loops on the CPU, that of its cores if None; the
            first start decides.
        writes_assembly: Whether Taichi writes the assembly of its kernels into the current folder.

    Raises:
        ValueError: CUDA is not there, or Taichi runs on another device in this process.
    """
    global _started
    if _started == device:
        return
    if _started is not None:
        raise ValueError(
            f"Taichi runs on {_started} in this process already, and cannot run on {device} too; "
            "use one of them in another process"
        )
    if device == "cuda":
        check_cuda()
    _skip_source_positions()
    keeps_kernels = _has_cache_folder()
    # Nothing is kept there, but Taichi crashes without a folder.
    elsewhere = {} if keeps_kernels else {"offline_cache_file_path": tempfile.gettempdir()}
    # Taichi prints that it starts, into results and progress bars.
    with contextlib.redirect_stdout(io.StringIO()):
        ti.init(
            arch=ti.cuda if device == "cuda" else ti.cpu,
            enable_fallback=False,
            default_fp=ti.f64,
            cpu_max_num_threads=threads or os.cpu_count() or 1,
            cuda_stack_limit=CUDA_STACK,
            # Kernels from the cache are not compiled, and yield no assembly.
            offline_cache=keeps_kernels and not writes_assembly,
            print_kernel_asm=writes_assembly,
            # LLVM optimizes anyway. Without Taichi's own passes the rod compiles in a quarter
            # of the time and runs 5 % slower.
            advanced_optimization=False,
            log_level=ti.WARN,
            **elsewhere,
        )
    _started = device


def check_cuda() -> None:
    """Refuse to go on without CUDA.

    Raises:
        ValueError: Taichi finds no driver of CUDA.
    """
    if not misc.is_arch_supported(ti.cuda):
        version = ".".join(map(str, ti.__version__))
        raise ValueError(
            f"device='cuda' needs a GPU of NVIDIA and its driver; Taichi {version} finds none "
            "(libcuda.so): use device='taichi-cpu' for all cores of the processor, or leave the "
            "device out"
        )


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
    source, binary = _binary(kernel, arrays, count)
    context = source.make_launch_context()
    for place, array in enumerate(arrays):
        context.set_arg_external_array_with_shape(
            (place,), array.ctypes.data, array.nbytes, array.shape[:1], 0
        )
    context.set_arg_int((len(arrays),), count)
    program: Any = get_runtime().prog
    program.launch_kernel(binary, context)


def launch_on_device(
    kernel: Any,
    arrays: Sequence[Int32[np.ndarray, "k"] | Float64[np.ndarray, "m *e"]],
    count: int,
) -> None:
    """Launch a kernel on copies of its arrays in the memory of the device, and copy them back.

    Arrays that share their memory do so there, too. Taichi itself would copy each of them.

    Args:
        kernel: Kernel of these arrays and a number.
        arrays: As in `launch`; those that share memory begin with the longest, of numbers.
        count: Number of rods.
    """
    source, binary = _binary(kernel, arrays, count)
    context = source.make_launch_context()
    copies: dict[int, tuple[Any, np.ndarray[Any, Any]]] = {}
    for place, array in enumerate(arrays):
        if array.ctypes.data not in copies:
            copy = _device_array(array.dtype.str, array.size, place)
            copy.from_numpy(array)
            copies[array.ctypes.data] = copy, array
        context.set_arg_ndarray((place,), copies[array.ctypes.data][0].arr)
    context.set_arg_int((len(arrays),), count)
    program: Any = get_runtime().prog
    program.launch_kernel(binary, context)
    for copy, array in copies.values():
        array[:] = copy.to_numpy()


@functools.lru_cache(maxsize=8)
def _device_array(dtype: str, size: int, place: int) -> Any:
    """Return an array on the device, which is kept for further launches of the same size."""
    del place
    return ti.ndarray(ti.i32 if dtype == "<i4" else ti.f64, size)


def _binary(kernel: Any, arrays: Sequence[np.ndarray[Any, Any]], count: int) -> tuple[Any, Any]:
    """Return source and machine code of a kernel, which is compiled the first time."""
    if kernel not in _compiled:
        program: Any = get_runtime().prog
        source = kernel._primal.compiled_kernels[kernel._primal.ensure_compiled(*arrays, count)]
        binary = program.compile_kernel(program.config(), program.get_device_caps(), source)
        _compiled[kernel] = source, binary
    return _compiled[kernel]


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
