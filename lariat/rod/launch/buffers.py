"""Arrays of one launch: fills them, launches, and shows the answers as views."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float64, Int32, Int64

from lariat.rod.launch import layout, machine_code
from lariat.rod.launch.layout import Sizes


@lru_cache(maxsize=256)
def _plan(
    sizes: Sizes,
) -> tuple[dict[int, tuple[int, int]], int, Int32[np.ndarray, "k"]]:
    offsets, stride = layout.sections(sizes)
    count = layout.INTEGERS + sizes.horizon + layout.PARAMETER_WIDTH * sizes.parameters
    integers = np.zeros(count, dtype=np.int32)
    integers[layout.BATCH] = sizes.batch
    integers[layout.NODES] = sizes.nodes
    integers[layout.STEPS] = sizes.steps
    integers[layout.HORIZON] = sizes.horizon
    integers[layout.SUBSTEPS] = sizes.steps // sizes.horizon
    integers[layout.HISTORY] = sizes.history
    integers[layout.BLOCKS] = sizes.blocks
    integers[layout.OBSTACLES] = sizes.obstacles
    integers[layout.PARAMETERS] = sizes.parameters
    integers[layout.DIRECTIONS] = sizes.directions
    integers[layout.DRIVEN] = sizes.driven
    integers[layout.WANT] = sizes.want
    integers[layout.MOST_TOUCHES] = sizes.touches
    integers[layout.STRIDE] = stride
    for name, (start, _) in offsets.items():
        integers[name] = start
    integers[layout.AT_OBSTACLES] = stride * sizes.batch
    return offsets, stride, integers


class Launch:
    """Holds the two arrays; grown when a launch needs more, never shrunk."""

    def __init__(self) -> None:
        self._doubles = np.zeros(0)

    def open(
        self,
        sizes: Sizes,
        block_of_step: Int64[np.ndarray, "H"],
        parameters: Int64[np.ndarray, "P 3"],
    ) -> Sheet:
        """Sections for these sizes, to be filled."""
        offsets, stride, integers = _plan(sizes)
        needed = stride * sizes.batch + layout.OBSTACLE_WIDTH * sizes.obstacles
        if len(self._doubles) < needed:
            self._doubles = np.zeros(int(1.5 * needed))
        integers = integers.copy()
        integers[layout.INTEGERS : layout.INTEGERS + sizes.horizon] = block_of_step
        integers[layout.INTEGERS + sizes.horizon :] = parameters.ravel()
        rods = self._doubles[: stride * sizes.batch].reshape(sizes.batch, -1)
        return Sheet(sizes, offsets, integers, self._doubles, rods)


@dataclass(frozen=True)
class Sheet:
    """The arrays of one launch, cut into sections."""

    sizes: Sizes
    offsets: dict[int, tuple[int, int]]
    integers: Int32[np.ndarray, "k"]
    doubles: Float64[np.ndarray, "m"]
    rods: Float64[np.ndarray, "B s"]
    """The stretch of each rod, as a view."""

    def section(self, name: int) -> Float64[np.ndarray, "B k"]:
        """A section of every rod of the batch, as a view."""
        start, length = self.offsets[name]
        return self.rods[:, start : start + length]

    def obstacles(self) -> Float64[np.ndarray, "m 17"]:
        """The rows of the scene, as a view."""
        end = self.rods.size + layout.OBSTACLE_WIDTH * self.sizes.obstacles
        return self.doubles[self.rods.size : end].reshape(-1, layout.OBSTACLE_WIDTH)

    def run(self) -> None:
        """Launch the kernel on what has been filled in."""
        (machine_code.kernel() or _through_taichi)(self.integers, self.doubles, self.sizes.batch)


def _through_taichi(
    integers: Int32[np.ndarray, "k"], doubles: Float64[np.ndarray, "m"], count: int
) -> None:
    # Taichi is slow to import, and kernels compile against its runtime, which must stand first.
    from lariat.rod.launch import taichi_runtime

    taichi_runtime.start()
    from lariat.rod.kernels import rollout

    taichi_runtime.launch(rollout.roll, integers, doubles, count)
