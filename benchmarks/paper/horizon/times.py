"""Time to plan one horizon, by method and number of nodes.

The rope of `scenarios/three-cylinders.toml` moves towards its goal, past the obstacles, by 20 ms
between two calls, so that every call starts as in a run: from the previous solution, near
obstacles, with a moving rope. A step of the controller contains more than its horizon.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from typing import Literal

import numpy as np
from jaxtyping import Float64
from rich.console import Console
from rich.progress import track

from lariat.control.mpc.collision_avoidance import AvoidanceSpecification
from lariat.control.mpc.horizon import HorizonProblem
from lariat.controllers import horizon_optimizer
from lariat.rod import Rod, RodState, RolloutSpec
from lariat.safety.motion_contract import PATHLESS_LIMIT_SHARE
from lariat.scenario import Scenario
from lariat.scenario.rod_properties import rod_properties

MAX_GRIP_DISTANCE = 0.44
"""Largest distance of the grips that the horizon allows [m]."""
VELOCITY_GAIN = 0.4
"""Share of the planned velocity that the grips take up between two calls [-]."""
CALL_PERIOD = 0.02
"""Simulated time between two calls [s]."""
WARM_UP_CALLS = 10
"""Number of calls that are not timed."""
Method = Literal["gauss_newton", "actions", "network"]
"""Control method of a scenario."""


def planning_times(
    base: Scenario, method: Method, count: int, calls: int
) -> Float64[np.ndarray, "c"]:
    """Return the wall times of successive horizons [ms]."""
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
