"""Kernels of the distances of spheres, in place of calls of NumPy where they are compiled."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lariat.machine_code import library
from lariat.machine_code.call import CompiledKernel
from lariat.machine_code.kernel_source import KernelSource


def _source(function: str) -> KernelSource:
    return KernelSource(
        function.replace("_", "-"),
        f"lariat.safety.constraints.kernels:{function}",
        ("lariat.safety.constraints.kernels",),
        f"lariat.safety.constraints.kernel_trials:{function}",
        Path(__file__).parents[3],
    )


SPHERE_SLACKS = _source("sphere_slacks")
GRIPPER_SLACKS = _source("gripper_slacks")
LEAST_DISTANCES = _source("least_distances")
SOURCES = (SPHERE_SLACKS, GRIPPER_SLACKS, LEAST_DISTANCES)
"""All kernels of the constraints."""


@dataclass(frozen=True)
class SphereKernels:
    """The compiled kernels, whose arguments `kernels` documents."""

    sphere_slacks: CompiledKernel
    """Slacks of spheres."""
    gripper_slacks: CompiledKernel
    """Slacks of grips and grippers."""
    least_distances: CompiledKernel
    """Distances between two sets of spheres."""

    @classmethod
    def compiled(cls) -> SphereKernels | None:
        """Return the kernels; None where there is no compiler and none has been compiled."""
        found = [library.compiled_kernel(source) for source in SOURCES]
        kernels = [kernel for kernel in found if kernel is not None]
        return cls(*kernels) if len(kernels) == len(found) else None


def finite(numbers: np.ndarray) -> bool:
    """Return whether all numbers are finite, as the compiler takes them to be.

    Their sum is not where one of them is not, and is found in half of the time; numbers whose sum
    overflows do not count as finite either.
    """
    return math.isfinite(np.add.reduce(numbers, axis=None))
