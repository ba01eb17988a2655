"""How long roll-outs and their derivatives take, and how long the first one."""

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
HORIZON, DT = 5, 0.01
PILLARS = pack(
    [Obstacle("cylinder", (x, 0.15, 0.1), radius=0.03, height=0.2) for x in (-0.1, 0.0, 0.1)]
    + [TABLE]
)

_START = """
import resource, time
begin = time.perf_counter()
import numpy as np
from lariat.rod import Rod, RodProperties, RolloutSpec
rod = Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 10)
state = rod.straight([0.0, 0.0, 0.3], [1.0, 0.0, 0.3])
rod.gradient(RolloutSpec(state, np.zeros((2, 2, 6)), 0.01), np.zeros((2, 10, 3)))
whose = resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN
used = [resource.getrusage(one) for one in whose]
print(sum(one.ru_utime + one.ru_stime for one in used), time.perf_counter() - begin)
"""


def by_size(repeats: int = 200) -> list[dict[str, float]]:
    """Best processor time of a call [ms]: a moving rod of n nodes, both grips driven."""
    return [_timed(n, max(20, repeats * 40 // max(n, 40))) for n in (10, 40, 100, 400)]


def _timed(n: int, repeats: int) -> dict[str, float]:
    rod, state, actions = moving(n)
    spec = RolloutSpec(state, actions, DT, obstacles=PILLARS)
    slope = np.random.default_rng(0).normal(size=(HORIZON, n, 3))

    def gradient(parameters: tuple[str, ...]) -> Callable[[], object]:
        return lambda: rod.gradient(spec, slope, parameters)

    iterations = rod.rollout(spec).iterations
    return {
        "nodes": n,
        "iterations": float(np.mean(iterations)),
        "rollout_ms": best(lambda: rod.rollout(spec), repeats),
        "with_gradient_ms": best(gradient(()), repeats),
        "with_all_parameters_ms": best(gradient(PARAMETERS), repeats),
        "with_60_columns_ms": best(lambda: rod.linearize(spec), repeats),
    }


def moving(n: int) -> tuple[Rod, RodState, Float64[np.ndarray, "K 2 6"]]:
    """A rod, where it is in full motion, and what its grips do."""
    rod = Rod(PROPERTIES, n)
    actions = np.zeros((HORIZON, 2, 6))
    actions[:, 0] = [0.1, 0.1, 0.0, 0.0, 1.0, 0.0]
    actions[:, 1] = [-0.3, 0.1, 0.1, 1.0, 0.0, 1.0]
    start = rod.straight([-0.225, 0.0, 0.3], [0.225, 0.0, 0.3])
    return rod, rod.rollout(RolloutSpec(start, actions, DT, obstacles=PILLARS)).final, actions


def batched(count: int = 64, n: int = 40, repeats: int = 5) -> float:
    """Node steps per second and core, many rods in one launch."""
    rod, state, actions = moving(n)
    many = np.repeat(actions[None], count, axis=0)
    spec = RolloutSpec([state] * count, many, DT, obstacles=PILLARS)
    took = best(lambda: rod.rollout(spec), repeats)
    return count * n * HORIZON / (1e-3 * took)


def first_launch() -> dict[str, float]:
    """Processor and wall time of a fresh process up to its first gradient [s].

    With what it starts: the first of all has another one write machine code.
    """
    with tempfile.TemporaryDirectory() as cache:
        cold = _fresh(cache)
        cached = min(_fresh(cache) for _ in range(2))
    return {
        "cold_cpu_s": cold[0],
        "cold_wall_s": cold[1],
        "cached_cpu_s": cached[0],
        "cached_wall_s": cached[1],
    }


def _fresh(cache: str) -> tuple[float, float]:
    environment = {**os.environ, "TI_OFFLINE_CACHE_FILE_PATH": cache, "HOME": cache}
    done = subprocess.run(
        [sys.executable, "-c", _START], env=environment, capture_output=True, text=True, check=True
    )
    cpu, wall = done.stdout.split()[-2:]
    return float(cpu), float(wall)


def best(call: Callable[[], object], repeats: int) -> float:
    """Least processor time of a call [ms]; what else runs on the machine counts less in it."""
    call()
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        call()
        times.append(time.process_time() - begin)
    return 1e3 * min(times)
