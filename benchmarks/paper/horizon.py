"""Time to plan one horizon: `lariat bench paper horizon`.

The rope of `three-cylinders` moves towards its goal, past the obstacles, by 20 ms between two
calls, so that every call starts as in a run: from the previous solution, near obstacles, with a
moving rope. A step of the controller contains more than its horizon.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Literal

import numpy as np

from benchmarks.paper.closed_loop import horizon_problem
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from lariat.control.mpc.collision_avoidance import AvoidanceSpecification
from lariat.controllers import horizon_optimizer
from lariat.rod import Rod, RolloutSpec
from lariat.safety.motion_contract import PATHLESS_LIMIT_SHARE
from lariat.scenario import load
from lariat.scenario.rod_properties import rod_properties

BASE_SCENARIO = "three-cylinders"
"""Scenario of rope, goal and obstacles."""
MAX_GRIP_DISTANCE = 0.44
"""Largest distance of the grips that a horizon allows [m]."""
VELOCITY_GAIN = 0.4
"""Share of the planned velocity that the grips take up between two calls [-]."""
CALL_PERIOD, WARM_UP_CALLS = 0.02, 10
"""Simulated time between two calls [s], and number of calls that are not timed."""
Method = Literal["gauss_newton", "actions", "network"]


def run(
    method: tuple[Method, ...] = ("gauss_newton", "actions", "network"),
    nodes: tuple[int, ...] = (40,),
    calls: int = 200,
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Time the planning of one horizon [ms].

    Wall time on one core; the plant is the same rod as the model, whose state is known, and the
    controller does not adapt. `lariat run --json` compares the horizons of a whole run with the
    true rope: `horizon_error_mm` beside `sensing_error_mm`.

    Examples:
      lariat bench paper horizon --method gauss_newton --nodes 20 40 80

    Args:
        method: Control methods to time.
        nodes: Numbers of nodes of the rope to time.
        calls: Number of timed horizons for each method and number of nodes.
    """
    times = [planning_times(name, n, calls) for n in nodes for name in method]
    notes = "plant = model (Lariat's rod), state known, not adapting; the paper: 1700 ms, GPU"
    options.publish(Result("times", times, notes))
    return 0


def planning_times(method: Method, count: int, calls: int) -> dict[str, object]:
    """Return wall times of successive horizons of a rope with some number of nodes [ms]."""
    base = load(BASE_SCENARIO)
    scenario = replace(
        base,
        rope=replace(base.rope, node_count=count),
        control=replace(base.control, method=method),
    )
    rod = Rod(rod_properties(scenario.rope), count)
    start = state = rod.rest(*scenario.grips(scenario.start)).state
    goal = rod.rest(*scenario.grips(scenario.goal)).state.positions
    moves = np.zeros((2, 6), dtype=bool)
    moves[:, :3] = True
    limits = scenario.limits.scaled(PATHLESS_LIMIT_SHARE)
    optimizer = horizon_optimizer(scenario.control, moves, limits, count)
    avoidance = AvoidanceSpecification(
        scenario.bodies, scenario.control.clearance, scenario.rope.diameter / 2.0, MAX_GRIP_DISTANCE
    )
    velocity = np.zeros((2, 2, 3))
    times = []
    for k in range(calls + WARM_UP_CALLS):
        if k == calls // 2:
            state, velocity = start, 0.0 * velocity
        problem = horizon_problem(optimizer, state, goal, velocity)
        optimizer.shift(CALL_PERIOD)
        started = time.perf_counter()
        plan = optimizer.plan(rod, problem, avoidance)
        times.append(1e3 * (time.perf_counter() - started))
        velocity = velocity + VELOCITY_GAIN * (plan.velocities[0] - velocity)
        moved = RolloutSpec(state, velocity.reshape(1, 2, 6), CALL_PERIOD / 4.0, steps=4)
        state = rod.rollout(moved).final
    if not np.all(np.isfinite(state.positions)):
        raise ValueError(f"{method} with {count} nodes lost the rope")
    p50, p99, longest = np.quantile(times[WARM_UP_CALLS:], [0.5, 0.99, 1.0]).round(3).tolist()
    return {"method": method, "nodes": count, "p50_ms": p50, "p99_ms": p99, "max_ms": longest}
