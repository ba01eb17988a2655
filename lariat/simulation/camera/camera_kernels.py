"""Kernels of the simulated camera."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

from lariat.kernel_cache import cache
from lariat.kernel_cache.call import CompiledKernel
from lariat.kernel_cache.source import KernelSource

PACKAGE = "lariat.simulation.camera"
KERNELS = f"{PACKAGE}.kernels"


def _source(module: str, function: str, *others: str) -> KernelSource:
    return KernelSource(
        f"camera-{module}",
        f"{KERNELS}.{module}:{function}",
        (*(f"{KERNELS}.{name}" for name in (module, "rays", "depths")), *others),
        f"{PACKAGE}.kernel_self_tests:{module}",
        Path(__file__).parents[3],
    )


BODIES = _source("bodies", "draw_bodies", "lariat.shapes")
PLATES = _source("plates", "draw_plates")
ROPE = _source("rope", "draw_rope")
EDGES = _source("edges", "disturb_edges")
SOURCES = (BODIES, PLATES, ROPE, EDGES)
"""All kernels of the camera."""


class CameraKernels:
    """Kernels, each loaded when it is first used."""

    @cached_property
    def draw_bodies(self) -> CompiledKernel:
        """Drawing of obstacles."""
        return cache.kernel(BODIES)

    @cached_property
    def draw_plates(self) -> CompiledKernel:
        """Drawing of marker plates."""
        return cache.kernel(PLATES)

    @cached_property
    def draw_rope(self) -> CompiledKernel:
        """Drawing of chains of capsules."""
        return cache.kernel(ROPE)

    @cached_property
    def disturb_edges(self) -> CompiledKernel:
        """Noise of the depth sensor at edges."""
        return cache.kernel(EDGES)
