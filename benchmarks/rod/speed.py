"""Times of roll-outs and their derivatives, and of the first one of a process."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import TABLE, Obstacle, pack
from lariat.rod import PARAMETERS, Rod, RodProperties, RodState, RolloutSpec

PROPERTIES = RodProperties(0.45, 0.008, 0.044, 1e6)
"""Properties of the rod."""
STEP_COUNT, TIME_STEP = 5, 0.01
"""Number of steps, and time step [s]."""
OBSTACLES = pack(
    [Obstacle("cylinder", (x, 0.15, 0.1), radius=0.03, height=0.2) for x in (-0.1, 0.0, 0.1)]
    + [TABLE]
)
"""Three cylinders and the table, packed."""

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
    rod, state, actions = moving_rod(n)
    spec = RolloutSpec(state, actions, TIME_STEP, obstacles=OBSTACLES)
    slope = np.random.default_rng(0).normal(size=(STEP_COUNT, n, 3))

    def gradient(parameters: tuple[str, ...]) -> Callable[[], object]:
        return lambda: rod.gradient(spec, slope, parameters)

    iterations = rod.rollout(spec).iterations
    return {
        "nodes": n,
        "iterations": float(np.mean(iterations)),
        "rollout_ms": least_time(lambda: rod.rollout(spec), repeats),
        "with_gradient_ms": least_time(gradient(()), repeats),
        "with_all_parameters_ms": least_time(gradient(PARAMETERS), repeats),
        "with_60_columns_ms": least_time(lambda: rod.linearize(spec), repeats),
    }


def moving_rod(n: int) -> tuple[Rod, RodState, Float64[np.ndarray, "K 2 6"]]:
    """Return a rod of n nodes, its state in full motion, and the velocities of its grips."""
    rod = Rod(PROPERTIES, n)
    actions = np.zeros((STEP_COUNT, 2, 6))
    actions[:, 0] = [0.1, 0.1, 0.0, 0.0, 1.0, 0.0]
    actions[:, 1] = [-0.3, 0.1, 0.1, 1.0, 0.0, 1.0]
    start = rod.straight([-0.225, 0.0, 0.3], [0.225, 0.0, 0.3])
    return (
        rod,
        rod.rollout(RolloutSpec(start, actions, TIME_STEP, obstacles=OBSTACLES)).final,
        actions,
    )


def first_launch() -> dict[str, float]:
    """Return processor and wall time of a fresh process until its first gradient [s].

    The times include child processes: the very first process starts one that writes machine code.
    """
    with tempfile.TemporaryDirectory() as cache:
        cold = _fresh_process_times(cache)
        cached = min(_fresh_process_times(cache) for _ in range(2))
    return {
        "cold_cpu_s": cold[0],
        "cold_wall_s": cold[1],
        "cached_cpu_s": cached[0],
        "cached_wall_s": cached[1],
    }


def _fresh_process_times(cache: str) -> tuple[float, float]:
    environment = {**os.environ, "TI_OFFLINE_CACHE_FILE_PATH": cache, "HOME": cache}
    done = subprocess.run(
        [sys.executable, "-c", FIRST_GRADIENT],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    cpu, wall = done.stdout.split()[-2:]
    return float(cpu), float(wall)


def least_time(call: Callable[[], object], repeats: int) -> float:
    """Return the least processor time of a call [ms], which other processes disturb least."""
    call()
    times = []
    for _ in range(repeats):
        started = time.process_time()
        call()
        times.append(time.process_time() - started)
    return 1e3 * min(times)
