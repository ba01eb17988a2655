"""Kernels of the grips' motion."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float64

from lariat.kernel_cache import cache
from lariat.kernel_cache.call import CompiledKernel
from lariat.kernel_cache.source import KernelSource
from lariat.trajectory import MotionLimits

PACKAGE = "lariat.control.mpc"
Function = Literal["bound_velocities", "track_velocities", "stop_grips"]
"""Names of the kernels."""


def _source(function: str) -> KernelSource:
    return KernelSource(
        function.replace("_", "-"),
        f"{PACKAGE}.kernels:{function}",
        (f"{PACKAGE}.kernels",),
        f"{PACKAGE}.kernel_self_tests:{function}",
        Path(__file__).parents[3],
    )


SOURCES = {function: _source(function) for function in get_args(Function)}
"""All kernels of the controller."""


def kernel(function: Function) -> CompiledKernel:
    """Return a kernel, whose arguments `kernels` documents."""
    return cache.kernel(SOURCES[function])


@functools.lru_cache(maxsize=8)
def bounds_of(limits: MotionLimits) -> Float64[np.ndarray, "2 3"]:
    """Return the limits on speed, acceleration and jerk as the kernels take them."""
    return np.hstack([limits.speed_bounds, limits.acceleration_bounds, limits.jerk_bounds])


def rows_of(vectors: Float64[np.ndarray, "*b 3"]) -> Float64[np.ndarray, "r 3"]:
    """Return vectors as the kernels take them."""
    return np.ascontiguousarray(vectors).reshape(-1, 3)
