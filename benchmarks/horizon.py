"""How long one horizon takes to plan, by method and number of nodes: `lariat bench horizon`.

The rope of `scenarios/three-cylinders.toml` is led towards its goal past the obstacles, 20 ms a
call, so that every call finds what it would find in a run: an answer of the call before, obstacles
in reach, a rope in motion. One core; a step of the controller holds more than its horizon.
"""

from __future__ import annotations

import json as encoder
import sys
import time
from dataclasses import replace
from pathlib import Path
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

BASE = Path(__file__).parents[1] / "scenarios" / "three-cylinders.toml"
STEP = 0.02
"""Between calls [s]."""
PAPER = 1700.0
"""What the paper reports for one horizon of its own [ms]."""
Method = Literal["gauss_newton", "actions", "network"]


def run(
    method: tuple[Method, ...] = ("gauss_newton", "actions", "network"),
    nodes: tuple[int, ...] = (40,),
    calls: int = 200,
    json: bool = False,
) -> int:
    """Times horizons and prints median, 99th percentile and longest [ms].

    Args:
        method: Ways to use the horizon.
        nodes: Numbers of nodes of the rope.
        calls: Horizons timed for each; a few more warm up.
        json: One JSON object instead of a table.
    """
    base = load(BASE)
    rows: list[dict[str, float | str]] = []
    for count in nodes:
        for name in method:
            times = _times(base, name, count, calls)
            p50, p99, longest = np.quantile(times, [0.5, 0.99, 1.0]).round(3).tolist()
            rows.append({"method": name, "nodes": count, "p50": p50, "p99": p99, "max": longest})
    if json:
        print(encoder.dumps({"ms": rows, "paper_ms": PAPER}))
        return 0
    table = Table("method", "nodes", "p50 ms", "p99 ms", "max ms")
    for row in rows:
        table.add_row(*(str(value) for value in row.values()))
    Console().print(table, f"The paper reports {PAPER:g} ms for a horizon of its own, on a GPU.")
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
        scenario.bodies, scenario.control.clearance, scenario.rope.diameter / 2.0, 0.44
    )
    velocity = np.zeros((2, 2, 3))
    times = []
    progress = Console(stderr=True)
    for k in track(range(calls + 10), f"{method}, {count} nodes", console=progress, transient=True):
        if k == calls // 2:
            state, velocity = rod.rest(*scenario.grips(scenario.start)).state, 0.0 * velocity
        asked = HorizonProblem(
            state,
            np.zeros((count, 3)),
            np.zeros((horizon, 2, 6)),
            np.repeat(goal[None], horizon, axis=0),
            velocity,
            np.zeros((2, 6)),
            np.zeros((2, 6), dtype=bool),
        )
        optimizer.shift(STEP)
        began = time.perf_counter()
        plan = optimizer.plan(rod, asked, avoidance)
        times.append(1e3 * (time.perf_counter() - began))
        velocity = velocity + 0.4 * (plan.velocities[0] - velocity)
        state = _moved(rod, state, velocity)
    if not np.all(np.isfinite(state.positions)):
        print(f"{method} with {count} nodes lost the rope", file=sys.stderr)
    return np.array(times[10:])


def _moved(rod: Rod, state: RodState, velocity: Float64[np.ndarray, "2 2 3"]) -> RodState:
    return rod.rollout(RolloutSpec(state, velocity.reshape(1, 2, 6), STEP / 4.0, steps=4)).final
