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

from benchmarks.compare.motion import ACTION_DURATION, PROPERTIES, rest_state
from benchmarks.compare.mujoco_ropes import ROPES, MujocoRun, RopeMaker
from lariat.rod import Rod, RodState, RolloutSpec

ROD_COUNT, NODE_COUNT, STEP_COUNT = 64, 40, 5
"""Number of ropes of a batch, of their nodes, and of steps of 10 ms of a call."""
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
    """Yield the throughput of roll-outs, of gradients, and of MuJoCo's two ropes."""
    rng = np.random.default_rng(0)
    speeds = rng.uniform(-0.3, 0.3, (ROD_COUNT, 3))
    start = rest_state(NODE_COUNT)
    for count in threads:
        rod = Rod(PROPERTIES, NODE_COUNT, threads=count)
        spec = _spec(start, speeds)
        cost = rng.standard_normal((ROD_COUNT, STEP_COUNT, NODE_COUNT, 3))
        yield _rate("direct", count, lambda rod=rod, spec=spec: rod.rollout(spec))
        yield _rate(
            "direct, with gradient",
            count,
            lambda rod=rod, spec=spec, cost=cost: rod.gradient(spec, cost, ()),
        )
        for name, make in ROPES.items():
            yield _rate(name, count, _mujoco(make, speeds, count))


def _spec(start: RodState, speeds: Float64[np.ndarray, "B 3"]) -> RolloutSpec[list[RodState]]:
    actions = np.zeros((ROD_COUNT, STEP_COUNT, 2, 6))
    actions[:, :, 1, :3] = speeds[:, None]
    return RolloutSpec([start] * ROD_COUNT, actions, ACTION_DURATION)


def _mujoco(
    make: RopeMaker, speeds: Float64[np.ndarray, "B 3"], threads: int
) -> Callable[[], None]:
    run = MujocoRun(make, NODE_COUNT, ACTION_DURATION, np.zeros((1, 2, 6)))
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
