"""Launches of the kernel: buffers for given sizes, and the call itself."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from jaxtyping import Int32, Int64

from lariat.kernel_cache import cache
from lariat.kernel_cache.source import KernelSource
from lariat.paper.xpbd.launch.layout import STEP_BLOCKS, Header
from lariat.paper.xpbd.launch.sizes import Sizes, sections
from lariat.rod.launch.buffers import BufferPool, LaunchBuffers

SOURCE = KernelSource(
    "xpbd",
    "lariat.paper.xpbd.kernels.rollout:roll_out",
    (
        "lariat.paper.xpbd.kernels",
        "lariat.paper.xpbd.launch.layout",
        "lariat.rod.kernels",
        "lariat.rod.launch.codes",
        "lariat.rod.launch.layout",
        "lariat.shapes",
    ),
    "lariat.paper.xpbd.launch.self_tests:self_tests",
)
"""The kernel of the paper's rod."""
MAX_DOUBLES = 5e8
"""Count of doubles that a launch may take: 4 GB, almost all of them tape."""


def allocate(
    pool: BufferPool, sizes: Sizes, block_of_step: Int64[np.ndarray, "H"]
) -> LaunchBuffers[Sizes]:
    """Return buffers for a launch, with all integers set that follow from the arguments.

    Args:
        pool: Memory of the doubles.
        sizes: Sizes of the launch.
        block_of_step: Action block that drives each step.

    Raises:
        ValueError: The tape would take too much memory.
    """
    places, stride, template = _plan(sizes)
    integers = template.copy()
    integers[STEP_BLOCKS:] = block_of_step
    return pool.cut(sizes, places, stride, integers)


def launch(buffers: LaunchBuffers[Sizes], *, forward: bool, backward: bool) -> None:
    """Run the kernel on buffers that have been filled."""
    run = cache.kernel(SOURCE)
    run(buffers.integers, buffers.doubles, buffers.sizes.batch, forward, backward)


@lru_cache(maxsize=64)
def _plan(sizes: Sizes) -> tuple[dict[int, slice], int, Int32[np.ndarray, "k"]]:
    """Return sections, count of doubles of a rod, and integer array; cached, since sizes recur."""
    places, stride = sections(sizes)
    if stride * sizes.batch > MAX_DOUBLES:
        raise ValueError(
            f"the tape of {sizes.steps} steps of {sizes.iterations} iterations takes "
            f"{8e-9 * stride * sizes.batch:.1f} GB; take fewer steps or iterations at a time"
        )
    integers = np.zeros(STEP_BLOCKS + sizes.steps // sizes.substeps, dtype=np.int32)
    integers[Header.NODES] = sizes.nodes
    integers[Header.STEPS] = sizes.steps
    integers[Header.SUBSTEPS] = sizes.substeps
    integers[Header.ACTION_BLOCKS] = sizes.action_blocks
    integers[Header.OBSTACLES] = sizes.obstacles
    integers[Header.ITERATIONS] = sizes.iterations
    integers[Header.TAPED] = sizes.taped
    integers[Header.CONTACT_LIMIT] = sizes.contact_limit
    integers[Header.OBSTACLE_ROWS] = stride * sizes.batch
    integers[Header.STRIDE] = stride
    for section, place in places.items():
        integers[section] = place.start
    return places, stride, integers
