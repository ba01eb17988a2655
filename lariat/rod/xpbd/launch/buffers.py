"""Arrays of one launch: fills them, launches, and shows the answers as views."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float64, Int32, Int64

from lariat.rod.obstacle_table import unpacked
from lariat.rod.xpbd.launch import layout
from lariat.rod.xpbd.launch.layout import Sizes

MOST = 5e8
"""Doubles that a launch may take: 4 GB, almost all of it tape."""


@lru_cache(maxsize=64)
def _plan(sizes: Sizes) -> tuple[dict[int, tuple[int, int]], int, Int32[np.ndarray, "k"]]:
    offsets, stride = layout.sections(sizes)
    if stride * sizes.batch > MOST:
        raise ValueError(
            f"the tape of {sizes.steps} steps of {sizes.iterations} iterations takes "
            f"{8e-9 * stride * sizes.batch:.1f} GB; take fewer steps or iterations at a time"
        )
    integers = np.zeros(layout.INTEGERS + sizes.steps // sizes.substeps, dtype=np.int32)
    integers[layout.NODES] = sizes.nodes
    integers[layout.STEPS] = sizes.steps
    integers[layout.BLOCKS] = sizes.blocks
    integers[layout.OBSTACLES] = sizes.obstacles
    integers[layout.ITERATIONS] = sizes.iterations
    integers[layout.SUBSTEPS] = sizes.substeps
    integers[layout.TAPED] = sizes.taped
    integers[layout.STRIDE] = stride
    integers[layout.CONTACT_LIMIT] = sizes.contact_limit
    for name, (start, _) in offsets.items():
        integers[name] = start
    integers[layout.AT_OBSTACLES] = stride * sizes.batch
    return offsets, stride, integers


class Launch:
    """Holds the array of doubles; grown when a launch needs more, never shrunk."""

    def __init__(self) -> None:
        self._doubles = np.zeros(0)
        self._scene: tuple[bytes, Float64[np.ndarray, "m 17"]] | None = None

    def rows(self, obstacles: Float64[np.ndarray, "m 12"] | None) -> Float64[np.ndarray, "m 17"]:
        """Obstacles as the kernel reads them; those of the launch before are remembered."""
        if obstacles is None:
            return np.zeros((0, layout.OBSTACLE_WIDTH))
        key = np.asarray(obstacles, float).tobytes()
        if self._scene is None or self._scene[0] != key:
            self._scene = key, unpacked(obstacles)
        return self._scene[1]

    def open(self, sizes: Sizes, block_of_step: Int64[np.ndarray, "H"]) -> Sheet:
        """Sections for these sizes, to be filled."""
        offsets, stride, integers = _plan(sizes)
        needed = stride * sizes.batch + layout.OBSTACLE_WIDTH * sizes.obstacles
        if len(self._doubles) < needed:
            self._doubles = np.zeros(needed + needed // 4)
        integers = integers.copy()
        integers[layout.INTEGERS :] = block_of_step
        return Sheet(sizes, offsets, stride, integers, self._doubles)


@dataclass(frozen=True)
class Sheet:
    """The arrays of one launch, cut into sections."""

    sizes: Sizes
    offsets: dict[int, tuple[int, int]]
    stride: int
    integers: Int32[np.ndarray, "k"]
    doubles: Float64[np.ndarray, "m"]

    def section(self, name: int) -> Float64[np.ndarray, "B k"]:
        """A section of every rod of the batch, as a view."""
        start, length = self.offsets[name]
        rods = self.doubles[: self.stride * self.sizes.batch].reshape(self.sizes.batch, -1)
        return rods[:, start : start + length]

    def obstacles(self) -> Float64[np.ndarray, "m 17"]:
        """The rows of the scene, as a view."""
        start = self.stride * self.sizes.batch
        end = start + layout.OBSTACLE_WIDTH * self.sizes.obstacles
        return self.doubles[start:end].reshape(-1, layout.OBSTACLE_WIDTH)

    def run(self, *, forward: bool, backward: bool) -> None:
        """Launch the kernel on what has been filled in."""
        # Taichi is slow to import, and kernels compile against its runtime, which must stand first.
        from lariat.rod.launch import taichi_runtime

        taichi_runtime.start()
        from lariat.rod.xpbd.kernels import rollout

        rollout.run(self.integers, self.doubles, self.sizes.batch, forward, backward)
