"""Kernels of the simulated camera."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

from lariat.machine_code import library
from lariat.machine_code.kernel_source import Kernel, KernelSource

PACKAGE = "lariat.simulation.camera"
KERNELS = f"{PACKAGE}.kernels"


def _source(module: str, function: str, *others: str) -> KernelSource:
    return KernelSource(
        f"camera-{module}",
        f"{KERNELS}.{module}:{function}",
        (*(f"{KERNELS}.{name}" for name in (module, "rays", "depths")), *others),
        f"{PACKAGE}.kernel_trials:{module}",
        Path(__file__).parents[3],
    )


BODIES = _source("bodies", "draw_bodies", "lariat.shapes")
PLATES = _source("plates", "draw_plates")
ROPE = _source("rope", "draw_rope")
EDGES = _source("edges", "disturb_edges")
SOURCES = (BODIES, PLATES, ROPE, EDGES)
"""All kernels of the camera."""


class CameraKernels:
    """Kernels, from their libraries or through Taichi, each loaded when it is first used."""

    @cached_property
    def draw_bodies(self) -> Kernel:
        """Drawing of obstacles."""
        return library.kernel(BODIES)

    @cached_property
    def draw_plates(self) -> Kernel:
        """Drawing of marker plates."""
        return library.kernel(PLATES)

    @cached_property
    def draw_rope(self) -> Kernel:
        """Drawing of chains of capsules."""
        return library.kernel(ROPE)

    @cached_property
    def disturb_edges(self) -> Kernel:
        """Noise of the depth sensor at edges."""
        return library.kernel(EDGES)
