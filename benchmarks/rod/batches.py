"""Throughput of batches of ropes on threads: Lariat's rod, and MuJoCo's ropes by `mujoco.batch`.

All ropes of a batch hang between two clamps, of which one moves; each rope by another velocity.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from mujoco.batch import Batch

from benchmarks.rod import work_precision as diagram
from benchmarks.rod.work_precision import ACTION_DURATION, LEFT_GRIP, NODE_COUNT, RIGHT_GRIP
from lariat.rod import Rod, RodState, RolloutSpec
from services.sim.plants.flex_rope import FlexRope
from services.sim.plants.linked_rope import LinkedRope

ROD_COUNT, STEP_COUNT = 64, 5
"""Number of ropes of a batch, and steps of 10 ms of a call."""
REPEATS = 5
"""Number of timed calls; the fastest counts."""


@dataclass(frozen=True)
class BatchRate:
    """Throughput of a solver."""

    solver: str
    """Name of the solver."""
    threads: int
    """Number of threads."""
    node_steps_per_s: float
    """Nodes of all ropes times steps of 10 ms, per second of wall time [1/s]."""


def rates(threads: tuple[int, ...] = (1, 2)) -> Iterator[BatchRate]:
    """Yield the throughput of roll-outs, of gradients, and of MuJoCo's two ropes.

    Args:
        threads: Numbers of threads to measure.
    """
    rng = np.random.default_rng(0)
    speeds = rng.uniform(-0.3, 0.3, (ROD_COUNT, 3))
    start = Rod(diagram.PROPERTIES, NODE_COUNT).rest(LEFT_GRIP, RIGHT_GRIP).state
    for count in threads:
        rod = Rod(diagram.PROPERTIES, NODE_COUNT, threads=count)
        spec = _spec(start, speeds)
        cost = rng.standard_normal((ROD_COUNT, STEP_COUNT, NODE_COUNT, 3))
        yield _rate("direct", count, lambda rod=rod, spec=spec: rod.rollout(spec))
        yield _rate(
            "direct, with gradient",
            count,
            lambda rod=rod, spec=spec, cost=cost: rod.gradient(spec, cost, ()),
        )
        for make, name in ((FlexRope, "MuJoCo flex"), (LinkedRope, "MuJoCo links")):
            yield _rate(name, count, _mujoco(make, start, speeds, count))


def _spec(start: RodState, speeds: Float64[np.ndarray, "B 3"]) -> RolloutSpec[list[RodState]]:
    actions = np.zeros((ROD_COUNT, STEP_COUNT, 2, 6))
    actions[:, :, 1, :3] = speeds[:, None]
    return RolloutSpec([start] * ROD_COUNT, actions, ACTION_DURATION)


def _mujoco(
    make: diagram.RopeMaker, start: RodState, speeds: Float64[np.ndarray, "B 3"], threads: int
) -> Callable[[], None]:
    run = diagram.MujocoRun(make, start, ACTION_DURATION)
    batch = Batch(run.model, nsim=ROD_COUNT, nthread=threads)
    positions, velocities = batch.bind("qpos"), batch.bind("qvel")
    grips, frames = batch.bind("mocap_pos"), batch.bind("mocap_quat")

    def roll_out() -> None:
        positions[:], velocities[:] = run.state.qpos, 0.0
        grips[:], frames[:] = run.state.mocap_pos, run.state.mocap_quat
        for _ in range(STEP_COUNT):
            grips[:, 1] += ACTION_DURATION * speeds
            batch.step()

    return roll_out


def _rate(solver: str, threads: int, call: Callable[[], object]) -> BatchRate:
    call()
    times = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return BatchRate(solver, threads, ROD_COUNT * NODE_COUNT * STEP_COUNT / min(times))
