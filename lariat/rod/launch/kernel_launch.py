"""Launches of the kernel: buffers for given sizes, and the call itself."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from jaxtyping import Float64, Int32, Int64

from lariat.rod.launch import machine_code
from lariat.rod.launch.buffers import BufferPool, LaunchBuffers
from lariat.rod.launch.layout import PARAMETER_WIDTH, STEP_BLOCKS, Header
from lariat.rod.launch.sizes import Sizes, sections


def allocate(
    pool: BufferPool,
    sizes: Sizes,
    block_of_step: Int64[np.ndarray, "H"],
    parameters: Int64[np.ndarray, "P 3"],
) -> LaunchBuffers[Sizes]:
    """Return buffers for a launch, with all integers set that follow from the arguments.

    Args:
        pool: Memory of the doubles.
        sizes: Sizes of the launch.
        block_of_step: Action block that drives each step.
        parameters: `Parameter`, knot and count of knots of each differentiated parameter.
    """
    places, stride, template = _plan(sizes)
    integers = template.copy()
    integers[STEP_BLOCKS : STEP_BLOCKS + sizes.horizon] = block_of_step
    integers[STEP_BLOCKS + sizes.horizon :] = parameters.ravel()
    return pool.cut(sizes, places, stride, integers)


def launch(buffers: LaunchBuffers[Sizes]) -> None:
    """Run the kernel on buffers that have been filled, from its library or through Taichi."""
    kernel = machine_code.kernel() or _through_taichi
    kernel(buffers.integers, buffers.doubles, buffers.sizes.batch)


@lru_cache(maxsize=256)
def _plan(sizes: Sizes) -> tuple[dict[int, slice], int, Int32[np.ndarray, "k"]]:
    """Return sections, count of doubles of a rod, and integer array; cached, since sizes recur."""
    places, stride = sections(sizes)
    count = STEP_BLOCKS + sizes.horizon + PARAMETER_WIDTH * sizes.parameters
    integers = np.zeros(count, dtype=np.int32)
    integers[Header.BATCH] = sizes.batch
    integers[Header.NODES] = sizes.nodes
    integers[Header.STEPS] = sizes.steps
    integers[Header.HORIZON] = sizes.horizon
    integers[Header.SUBSTEPS] = sizes.steps // sizes.horizon
    integers[Header.HISTORY] = sizes.history
    integers[Header.ACTION_BLOCKS] = sizes.action_blocks
    integers[Header.OBSTACLES] = sizes.obstacles
    integers[Header.PARAMETERS] = sizes.parameters
    integers[Header.STATE_DIRECTIONS] = sizes.state_directions
    integers[Header.ACTION_GROUPS] = sizes.action_groups
    integers[Header.DERIVATIVES] = sizes.derivatives
    integers[Header.MAX_SELF_CONTACTS] = sizes.self_contacts
    integers[Header.STRIDE] = stride
    integers[Header.OBSTACLE_ROWS] = stride * sizes.batch
    for section, place in places.items():
        integers[section] = place.start
    return places, stride, integers


def _through_taichi(
    integers: Int32[np.ndarray, "k"], doubles: Float64[np.ndarray, "m"], count: int
) -> None:
    # Taichi is slow to import, and kernels compile against its runtime, which must start first.
    from lariat.rod.launch import taichi_runtime

    taichi_runtime.start()
    from lariat.rod.kernels import rollout

    taichi_runtime.launch(rollout.roll_out, integers, doubles, count)
