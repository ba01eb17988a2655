"""Machine code of the rod's kernel."""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable

import numpy as np
from jaxtyping import Float64, Int32

from lariat.kernel_cache import cache
from lariat.kernel_cache.source import KernelSource
from lariat.rod.launch.layout import MATRIX_WIDTH

Kernel = Callable[[Int32[np.ndarray, "k"], Float64[np.ndarray, "m"], int], Callable[[], object]]
"""Function of the two arrays of `layout` and the number of rods, which returns their launch."""

SOURCE = KernelSource(
    "rod",
    "lariat.rod.kernels.rollout:roll_out",
    ("lariat.rod.kernels", "lariat.rod.launch.codes", "lariat.rod.launch.layout", "lariat.shapes"),
    "lariat.rod.launch.self_tests:self_tests",
)
"""The rod's kernel."""


class _Arguments(ctypes.Structure):
    """Arrays of the kernel and a number, laid out as Taichi passes them."""

    _fields_ = (
        ("integer_count", ctypes.c_int32),
        ("integers", ctypes.c_void_p),
        ("double_count", ctypes.c_int32),
        ("doubles", ctypes.c_void_p),
        ("matrix33_count", ctypes.c_int32),
        ("matrices33", ctypes.c_void_p),
        ("rod_count", ctypes.c_int32),
    )


@functools.cache
def kernel() -> Kernel:
    """Return the kernel, which is compiled if its machine code is not kept."""
    compiled = cache.kernel(SOURCE)

    def bind(
        integers: Int32[np.ndarray, "k"], doubles: Float64[np.ndarray, "m"], count: int
    ) -> Callable[[], object]:
        # The doubles are passed as matrices, too: no array has to be made for each.
        size, address = len(doubles), doubles.ctypes.data
        arguments = _Arguments(
            len(integers),
            integers.ctypes.data,
            size,
            address,
            size // MATRIX_WIDTH,
            address,
            count,
        )
        return compiled.bind(arguments, integers, doubles)

    return bind
