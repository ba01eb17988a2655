"""Time to plan one horizon, by method and number of nodes: `lariat bench horizon`.

The rope of `scenarios/three-cylinders.toml` moves towards its goal, past the obstacles, by 20 ms
between two calls, so that every call starts as in a run: from the previous solution, near
obstacles, with a moving rope. A step of the controller contains more than its horizon.
"""

from __future__ import annotations

import json as encoder
import sys
import time
from dataclasses import replace
from typing import Literal

import numpy as np
from jaxtyping import Float64
from rich.console import Console
from rich.progress import track
from rich.table import Table

from lariat.rod import Rod, RodState, RolloutSpec
from services.controller.model_factory import horizon_optimizer
from services.controller.mpc.collision_avoidance import AvoidanceSpecification
from services.controller.mpc.horizon import HorizonProblem
from shared.motion_contract import PATHLESS_LIMIT_SHARE
from shared.scenario import Scenario, load
from shared.scenario.rod_properties import rod_properties
from shared.scenario.shipped import find

BASE_SCENARIO = "three-cylinders"
"""Scenario of rope, goal and obstacles."""
MAX_GRIP_DISTANCE = 0.44
"""Largest distance of the grips that the horizon allows [m]."""
VELOCITY_GAIN = 0.4
"""Share of the planned velocity that the grips take up between two calls [-]."""
CALL_PERIOD = 0.02
"""Simulated time between two calls [s]."""
WARM_UP_CALLS = 10
"""Number of calls that are not timed."""
PAPER_HORIZON_MS = 1700.0
"""Time of one horizon that the paper reports [ms]."""
Method = Literal["gauss_newton", "actions", "network"]
"""Control method of a scenario."""


def run(
    method: tuple[Method, ...] = ("gauss_newton", "actions", "network"),
    nodes: tuple[int, ...] = (40,),
    calls: int = 200,
    json: bool = False,
) -> int:
    """Time the planning of one horizon: median, 99th percentile and longest [ms].

    Wall time on one core. The plant is the same rod as the model, whose state is known; the
    controller does not adapt.

    Examples:
      lariat bench horizon --method gauss_newton --nodes 20 40 80

    Args:
        method: Control methods.
        nodes: Numbers of nodes of the rope.
        calls: Number of timed horizons for each method and number of nodes.
        json: Print one JSON object instead of a table.
    """
    base = load(find(BASE_SCENARIO))
    rows: list[dict[str, float | str]] = []
    for count in nodes:
        for name in method:
            times = _times(base, name, count, calls)
            p50, p99, longest = np.quantile(times, [0.5, 0.99, 1.0]).round(3).tolist()
            rows.append({"method": name, "nodes": count, "p50": p50, "p99": p99, "max": longest})
    if json:
        print(encoder.dumps({"ms": rows, "paper_ms": PAPER_HORIZON_MS}))
        return 0
    table = Table(
        "method",
        "nodes",
        "p50 ms",
        "p99 ms",
        "max ms",
        caption="plant = model (Lariat's rod), state known, not adapting; wall time of one horizon",
    )
    for row in rows:
        table.add_row(*(str(value) for value in row.values()))
    Console().print(table, f"The paper reports {PAPER_HORIZON_MS:g} ms for one horizon, on a GPU.")
    return 0


def _times(base: Scenario, method: Method, count: int, calls: int) -> Float64[np.ndarray, "c"]:
    scenario = replace(
        base,
        rope=replace(base.rope, node_count=count),
        control=replace(base.control, method=method),
    )
    rod = Rod(rod_properties(scenario.rope), count)
    state = rod.rest(*scenario.grips(scenario.start)).state
    goal = rod.rest(*scenario.grips(scenario.goal)).state.positions
    moves = np.zeros((2, 6), dtype=bool)
    moves[:, :3] = True
    limits = scenario.limits.scaled(PATHLESS_LIMIT_SHARE)
    optimizer = horizon_optimizer(scenario.control, moves, limits, count)
    horizon = optimizer.step_count
    avoidance = AvoidanceSpecification(
        scenario.bodies, scenario.control.clearance, scenario.rope.diameter / 2.0, MAX_GRIP_DISTANCE
    )
    velocity = np.zeros((2, 2, 3))
    times = []
    progress = Console(stderr=True)
    for k in track(
        range(calls + WARM_UP_CALLS), f"{method}, {count} nodes", console=progress, transient=True
    ):
        if k == calls // 2:
            state, velocity = rod.rest(*scenario.grips(scenario.start)).state, 0.0 * velocity
        problem = HorizonProblem(
            state,
            np.zeros((count, 3)),
            np.zeros((horizon, 2, 6)),
            np.repeat(goal[None], horizon, axis=0),
            velocity,
            np.zeros((2, 6)),
            np.zeros((2, 6), dtype=bool),
        )
        optimizer.shift(CALL_PERIOD)
        started = time.perf_counter()
        plan = optimizer.plan(rod, problem, avoidance)
        times.append(1e3 * (time.perf_counter() - started))
        velocity = velocity + VELOCITY_GAIN * (plan.velocities[0] - velocity)
        state = _advance(rod, state, velocity)
    if not np.all(np.isfinite(state.positions)):
        print(f"{method} with {count} nodes lost the rope", file=sys.stderr)
    return np.array(times[WARM_UP_CALLS:])


def _advance(rod: Rod, state: RodState, velocity: Float64[np.ndarray, "2 2 3"]) -> RodState:
    return rod.rollout(
        RolloutSpec(state, velocity.reshape(1, 2, 6), CALL_PERIOD / 4.0, steps=4)
    ).final
