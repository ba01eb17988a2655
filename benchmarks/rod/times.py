"""Times of roll-outs and their derivatives, of batches, and of the first one of a process."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from benchmarks.compare.motion import PROPERTIES as BATCH_PROPERTIES
from benchmarks.compare.motion import rest_state
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
ROD_COUNT, BATCH_NODES, BATCH_CALLS = 64, 40, 5
"""Number of ropes of a batch, of their nodes, and of timed calls, of which the fastest counts."""
HISTORIES = {
    "none": (0.0, math.inf),
    "set": (0.0, 3.0),
    "friction": (0.3, math.inf),
    "set, friction": (0.3, 3.0),
}
"""Coefficient of friction of the table [-] and yield curvature of the rope [1/m]."""
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
    calls = {
        **_calls(rod, spec, slope),
        "with_all_parameters_ms": lambda: rod.gradient(spec, slope, PARAMETERS),
    }
    times = {name: 1e3 * least(call, repeats, time.process_time) for name, call in calls.items()}
    return {"nodes": n, "iterations": float(np.mean(rod.rollout(spec).iterations)), **times}


def _calls(
    rod: Rod, spec: RolloutSpec[RodState], slope: Float64[np.ndarray, "H n 3"]
) -> dict[str, Callable[[], object]]:
    return {
        "rollout_ms": lambda: rod.rollout(spec),
        "with_gradient_ms": lambda: rod.gradient(spec, slope, ()),
        "with_columns_ms": lambda: rod.linearize(spec),
    }


def by_history(n: int = 40, steps: int = 20) -> list[dict[str, object]]:
    """Return the least processor times of calls [ms], without and with set and friction.

    A slack rope, of which half lies on a table, is drawn along it by both grips, of which one
    rises.
    """
    actions = np.zeros((300, 2, 6))
    actions[:200, :, 2] = -0.04
    actions[:200, 0, 0], actions[:200, 1, 0] = 0.0045, -0.0045
    actions[200:, :, 0] = 0.1
    actions[200:, 1, 1] = 0.05
    drawn = np.tile(actions[-1], (steps, 1, 1))
    drawn[:, 1, 2] = 0.05
    slope = np.random.default_rng(0).normal(size=(steps, n, 3))
    rows: list[dict[str, object]] = []
    for name, (coefficient, limit) in HISTORIES.items():
        rod = Rod(replace(PROPERTIES, yield_curvature=limit), n)
        state = rod.straight([-0.225, 0.0, 0.1], [0.225, 0.0, 0.1])
        for part, friction in ((slice(0, 200), 0.0), (slice(200, 300), coefficient)):
            table = pack([Obstacle("half_space", (0.0, 0.0, 0.0), friction=friction)])
            state = rod.rollout(RolloutSpec(state, actions[part], TIME_STEP, obstacles=table)).final
        spec = RolloutSpec(state, drawn, TIME_STEP, obstacles=table)
        calls = _calls(rod, spec, slope)
        times = {key: 1e3 * least(call, 50, time.process_time) for key, call in calls.items()}
        motion = rod.rollout(spec)
        touching = motion.positions[:, :, 2] < 0.5 * PROPERTIES.diameter + 0.0005
        rows.append(
            {
                "history": name,
                "touching": float(np.mean(np.sum(touching, axis=1))),
                "yielding": _yielding_share(state, motion.final),
                "iterations": float(np.mean(motion.iterations)),
                **times,
            }
        )
    return rows


def _yielding_share(before: RodState, after: RodState) -> float:
    """Return the share of the bends whose set has grown [-]."""
    if before.plastic_curvature is None or after.plastic_curvature is None:
        return 0.0
    grown = np.abs(after.plastic_curvature - before.plastic_curvature) > 1e-9
    return float(np.mean(np.any(grown, axis=(1, 2))))


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
