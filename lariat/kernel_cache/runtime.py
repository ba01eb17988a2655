"""Taichi runtime of a process, which is started here and nowhere else.

A second `ti.init` would destroy every compiled kernel.
"""

from __future__ import annotations

import contextlib
import io
import os
import tempfile
from typing import Any, Literal

import numpy as np
from jaxtyping import Float64, Int32

from lariat.kernel_cache.language import ti

Device = Literal["cpu", "cuda"]
"""Device of the runtime."""
CUDA_STACK = 16384
"""Stack of a thread on CUDA [bytes]; the rod's real functions take 8 kB of it on an x86."""

_started: Device | None = None
"""Device of the runtime of this process; None before it starts."""


def start(
    device: Device = "cpu", *, threads: int | None = 1, writes_intermediate_code: bool = False
) -> None:
    """Start Taichi in double precision, once; further calls do nothing.

    Args:
        device: Device of all kernels of this process.
        threads: Number of threads of parallel loops on the CPU, that of its cores if None; the
            first start decides.
        writes_intermediate_code: Whether Taichi writes LLVM's intermediate code of its kernels into
            the current folder.

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
    settings: dict[str, Any] = {}
    if writes_intermediate_code:
        # Kernels of Taichi's own cache yield none; without a folder for it Taichi crashes.
        settings = {"offline_cache": False, "offline_cache_file_path": tempfile.gettempdir()}
        settings["print_kernel_llvm_ir"] = True
    # Taichi prints that it starts, into results and progress bars.
    with contextlib.redirect_stdout(io.StringIO()):
        ti.init(
            arch=ti.cuda if device == "cuda" else ti.cpu,
            enable_fallback=False,
            default_fp=ti.f64,
            cpu_max_num_threads=threads or os.cpu_count() or 1,
            cuda_stack_limit=CUDA_STACK,
            # LLVM optimizes anyway. Without Taichi's own passes the rod compiles in a quarter
            # of the time and runs 5 % slower.
            advanced_optimization=False,
            log_level=ti.WARN,
            **settings,
        )
    _started = device


def check_cuda() -> None:
    """Refuse to go on without CUDA.

    Raises:
        ValueError: Taichi finds no driver of CUDA.
    """
    if not ti.lang.misc.is_arch_supported(ti.cuda):
        version = ".".join(map(str, ti.__version__))
        raise ValueError(
            f"device='cuda' needs a GPU of NVIDIA and its driver; Taichi {version} finds none "
            "(libcuda.so): use device='taichi-cpu' for all cores of the processor, or leave the "
            "device out"
        )


def launch(
    kernel: Any,
    integers: Int32[np.ndarray, "k"],
    doubles: Float64[np.ndarray, "m"],
    matrices: Float64[np.ndarray, "l 3 3"],
    count: int,
) -> None:
    """Launch a kernel of the rod on the device, and bring its results back.

    Args:
        kernel: Kernel of these arrays and a number.
        integers: Sizes, offsets and indices.
        doubles: Inputs and results.
        matrices: The same memory as matrices.
        count: Number of rods.
    """
    if _started != "cuda":
        kernel(integers, doubles, matrices, count)
        return
    # Taichi would copy each array to the GPU and back by itself, and they would no longer be one.
    import torch

    moved = torch.from_numpy(doubles).cuda()
    same = moved[: matrices.size].view(-1, 3, 3)
    kernel(torch.from_numpy(integers).cuda(), moved, same, count)
    doubles[:] = moved.cpu().numpy()
