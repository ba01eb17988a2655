"""Launches of the kernel: buffers for given sizes, and the call itself."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from itertools import pairwise
from typing import Literal, get_args

import numpy as np
from jaxtyping import Int32, Int64

from lariat.rod.launch import machine_code
from lariat.rod.launch.buffers import BufferPool, LaunchBuffers, kernel_arrays
from lariat.rod.launch.layout import MODEL_HEADER, PARAMETER_WIDTH, STEP_BLOCKS, Header
from lariat.rod.launch.sizes import Sizes, sections

Device = Literal["taichi-cpu", "cuda"]
"""Device on which Taichi's runtime steps every rod of a batch in a thread of its own."""


def allocate(
    pool: BufferPool,
    sizes: Sizes,
    block_of_step: Int64[np.ndarray, "H"],
    model_header: Int32[np.ndarray, "c"],
    parameters: Int64[np.ndarray, "P 3"] | None,
) -> LaunchBuffers[Sizes]:
    """Return buffers for a launch, with all integers set that follow from the arguments.

    Args:
        pool: Memory of the doubles.
        sizes: Sizes of the launch.
        block_of_step: Action block that drives each step.
        model_header: Integers of the header that depend on the rod alone.
        parameters: `ParameterCode`, knot and count of knots of each differentiated parameter.
    """
    places, stride, template = _plan(sizes)
    buffers = pool.cut(sizes, places, stride, template)
    integers = buffers.integers
    integers[MODEL_HEADER] = model_header
    integers[STEP_BLOCKS : STEP_BLOCKS + sizes.horizon] = block_of_step
    if parameters is not None:
        integers[STEP_BLOCKS + sizes.horizon :] = parameters.ravel()
    return buffers


def launch(buffers: LaunchBuffers[Sizes], threads: int = 1, device: Device | None = None) -> None:
    """Run the kernel on buffers that have been filled.

    Args:
        buffers: Buffers with all inputs.
        threads: Number of threads that share the rods of the batch.
        device: Device of Taichi, or None for the kernel's machine code.
    """
    if device is not None:
        _on_device(device, buffers)
        return
    batch = buffers.sizes.batch
    threads = min(threads, batch)
    kernel = machine_code.kernel()
    if threads == 1:
        buffers.once(_bound_kernel)()
        return
    stride = int(buffers.integers[Header.STRIDE])

    def run_share(first: int, end: int) -> None:
        integers = buffers.integers.copy()
        # The obstacles lie behind the last rod, counted from the first rod of a share.
        integers[Header.OBSTACLE_ROWS] -= stride * first
        kernel(integers, buffers.doubles[stride * first :], end - first)()

    bounds = [batch * k // threads for k in range(threads + 1)]
    shares = [_executor(threads).submit(run_share, first, end) for first, end in pairwise(bounds)]
    for share in shares:
        share.result()


def check_device(device: Device | None, threads: int) -> None:
    """Refuse a device that is not there, or that would ignore the number of threads.

    Raises:
        ValueError: The device is unknown or missing, or several threads are asked for beside it.
    """
    if device is None:
        return
    if device not in get_args(Device):
        raise ValueError(f"device must be one of {', '.join(get_args(Device))}, got {device}")
    if threads > 1:
        raise ValueError(f"a device has threads of its own: leave out threads={threads}")
    if device == "cuda":
        from lariat.kernel_cache import runtime

        runtime.check_cuda()


def _bound_kernel(buffers: LaunchBuffers[Sizes]) -> Callable[[], object]:
    return machine_code.kernel()(buffers.integers, buffers.doubles, buffers.sizes.batch)


@lru_cache(maxsize=4)
def _executor(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="rod")


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
    integers[Header.FRICTION_PAIRS] = sizes.friction_pairs
    integers[Header.LAYERS] = sizes.layers
    integers[Header.MAX_SELF_CONTACTS] = sizes.self_contacts
    integers[Header.STRIDE] = stride
    integers[Header.OBSTACLE_ROWS] = stride * sizes.batch
    for section, place in places.items():
        integers[section] = place.start
    return places, stride, integers


def _on_device(device: Device, buffers: LaunchBuffers[Sizes]) -> None:
    # Taichi is slow to import, and kernels compile against its runtime, which must start first.
    from lariat.kernel_cache import runtime

    runtime.start("cuda" if device == "cuda" else "cpu", threads=None)
    from lariat.rod.kernels import rollout

    used = buffers.doubles[: buffers.rods.size + buffers.obstacles().size]
    arrays = kernel_arrays(buffers.integers, used)
    runtime.launch(rollout.roll_out_side_by_side, *arrays, buffers.sizes.batch)
