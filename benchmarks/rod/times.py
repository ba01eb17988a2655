"""Times of roll-outs and their derivatives, of batches, and of the first one of a process."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable

import numpy as np

from benchmarks.compare.motion import PROPERTIES as BATCH_PROPERTIES
from benchmarks.compare.motion import rest_state
from lariat.geometry.obstacles import TABLE, Obstacle, pack
from lariat.rod import PARAMETERS, Rod, RodProperties, RolloutSpec

PROPERTIES = RodProperties(0.45, 0.008, 0.044, 1e6)
"""Properties of the rod."""
STEP_COUNT, TIME_STEP = 5, 0.01
"""Number of steps, and time step [s]."""
OBSTACLES = pack(
    [Obstacle("cylinder", (x, 0.15, 0.1), radius=0.03, height=0.2) for x in (-0.1, 0.0, 0.1)]
    + [TABLE]
)
"""Three cylinders and the table, packed."""
ROD_COUNT, BATCH_NODES, BATCH_CALLS = 64, 40, 5
"""Number of ropes of a batch, of their nodes, and of timed calls, of which the fastest counts."""
FIRST_GRADIENT = """
import resource, time
started = time.perf_counter()
import numpy as np
from lariat.rod import Rod, RodProperties, RolloutSpec
rod = Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 10)
state = rod.straight([0.0, 0.0, 0.3], [1.0, 0.0, 0.3])
rod.gradient(RolloutSpec(state, np.zeros((2, 2, 6)), 0.01), np.zeros((2, 10, 3)))
whose = resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN
used = [resource.getrusage(one) for one in whose]
print(sum(one.ru_utime + one.ru_stime for one in used), time.perf_counter() - started)
"""
"""Program of a process that computes one gradient and prints processor and wall time [s]."""


def by_size(repeats: int = 200) -> list[dict[str, float]]:
    """Return the least processor times of a call [ms] by number of nodes; both grips move."""
    return [_times(n, max(20, repeats * 40 // max(n, 40))) for n in (10, 40, 100, 400)]


def _times(n: int, repeats: int) -> dict[str, float]:
    rod = Rod(PROPERTIES, n)
    actions = np.zeros((STEP_COUNT, 2, 6))
    actions[:, 0] = [0.1, 0.1, 0.0, 0.0, 1.0, 0.0]
    actions[:, 1] = [-0.3, 0.1, 0.1, 1.0, 0.0, 1.0]
    start = rod.straight([-0.225, 0.0, 0.3], [0.225, 0.0, 0.3])
    state = rod.rollout(RolloutSpec(start, actions, TIME_STEP, obstacles=OBSTACLES)).final
    spec = RolloutSpec(state, actions, TIME_STEP, obstacles=OBSTACLES)
    slope = np.random.default_rng(0).normal(size=(STEP_COUNT, n, 3))
    calls: dict[str, Callable[[], object]] = {
        "rollout_ms": lambda: rod.rollout(spec),
        "with_gradient_ms": lambda: rod.gradient(spec, slope, ()),
        "with_all_parameters_ms": lambda: rod.gradient(spec, slope, PARAMETERS),
        "with_60_columns_ms": lambda: rod.linearize(spec),
    }
    times = {name: 1e3 * least(call, repeats, time.process_time) for name, call in calls.items()}
    return {"nodes": n, "iterations": float(np.mean(rod.rollout(spec).iterations)), **times}


def by_batch(threads: tuple[int, ...] = (1, 2)) -> list[dict[str, object]]:
    """Return nodes of all ropes times steps per second of wall time [1/s], by threads.

    All ropes hang between two clamps, of which one moves; each rope by another velocity.
    """
    rng = np.random.default_rng(0)
    actions = np.zeros((ROD_COUNT, STEP_COUNT, 2, 6))
    actions[:, :, 1, :3] = rng.uniform(-0.3, 0.3, (ROD_COUNT, 1, 3))
    spec = RolloutSpec([rest_state(BATCH_NODES)] * ROD_COUNT, actions, TIME_STEP)
    cost = rng.standard_normal((ROD_COUNT, STEP_COUNT, BATCH_NODES, 3))
    rows: list[dict[str, object]] = []
    for count in threads:
        rod = Rod(BATCH_PROPERTIES, BATCH_NODES, threads=count)
        calls: dict[str, Callable[[], object]] = {
            "roll-out": lambda rod=rod: rod.rollout(spec),
            "with gradient": lambda rod=rod: rod.gradient(spec, cost, ()),
        }
        for name, call in calls.items():
            seconds = least(call, BATCH_CALLS, time.perf_counter)
            rate = ROD_COUNT * BATCH_NODES * STEP_COUNT / seconds
            rows.append({"call": name, "threads": count, "node_steps_per_s": rate})
    return rows


def first_launch() -> list[dict[str, object]]:
    """Return processor and wall time of a fresh process until its first gradient [s].

    The times include child processes: the very first process starts one that writes machine code.
    """
    with tempfile.TemporaryDirectory() as cache:
        cold = _fresh_process_times(cache)
        cached = min(_fresh_process_times(cache) for _ in range(2))
    return [
        {"kernel": kernel, "cpu_s": cpu, "wall_s": wall}
        for kernel, (cpu, wall) in (("compiled", cold), ("kept", cached))
    ]


def _fresh_process_times(cache: str) -> tuple[float, float]:
    environment = {**os.environ, "TI_OFFLINE_CACHE_FILE_PATH": cache, "HOME": cache}
    command = [sys.executable, "-c", FIRST_GRADIENT]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    cpu, wall = done.stdout.split()[-2:]
    return float(cpu), float(wall)


def least(call: Callable[[], object], repeats: int, clock: Callable[[], float]) -> float:
    """Return the least time of a call [s], after one that is not timed."""
    call()
    times = []
    for _ in range(repeats):
        started = clock()
        call()
        times.append(clock() - started)
    return min(times)
