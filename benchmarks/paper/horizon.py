"""Time to plan one horizon, and error of its prediction: `lariat bench paper horizon`.

Times: the rope of `three-cylinders` moves towards its goal, past the obstacles, by 20 ms between
two calls, so that every call starts as in a run: from the previous solution, near obstacles, with a
moving rope. A step of the controller contains more than its horizon. Errors: whole runs with the
camera, against a rope finer than the model.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float64

from benchmarks.campaign import CAMPAIGN_DEFAULTS, Trial
from benchmarks.conditions import Conditions
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from lariat.control.mpc.collision_avoidance import AvoidanceSpecification
from lariat.control.mpc.horizon import HorizonProblem
from lariat.controllers import horizon_optimizer
from lariat.rod import Rod, RolloutSpec
from lariat.safety.motion_contract import PATHLESS_LIMIT_SHARE
from lariat.scenario import load
from lariat.scenario.rod_properties import rod_properties
from lariat.scenario.settings import load_with
from stack.simulation import closed_loop

BASE_SCENARIO = "three-cylinders"
"""Scenario of rope, goal and obstacles of the timed horizons."""
MAX_NOISE_RATIO = 2.0
"""Largest ratio of prediction error and noise of a good horizon [-]."""
MAX_GRIP_DISTANCE = 0.44
"""Largest distance of the grips that a timed horizon allows [m]."""
VELOCITY_GAIN = 0.4
"""Share of the planned velocity that the grips take up between two calls [-]."""
CALL_PERIOD, WARM_UP_CALLS = 0.02, 10
"""Simulated time between two calls [s], and number of calls that are not timed."""
Method = Literal["gauss_newton", "actions", "network"]
PlantModel = Literal["rod", "mujoco", "links", "as shipped"]


@dataclass(frozen=True)
class ErrorSpec:
    """Run whose horizons are measured."""

    scenario: str
    model: PlantModel


def run(
    method: tuple[Method, ...] = ("gauss_newton", "actions", "network"),
    nodes: tuple[int, ...] = (40,),
    calls: int = 200,
    errors: tuple[str, ...] = ("three-cylinders", "markers", "rope", "cable"),
    plant: tuple[PlantModel, ...] = ("as shipped",),
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Time the planning of one horizon [ms], and compare its prediction with the true rope [mm].

    Wall time on one core; for the times, the plant is the same rod as the model, whose state is
    known, and the controller does not adapt. The errors are those of whole runs with the camera:
    the plant has three times the model's edges, and rope and cable adapt. Each takes half a minute.

    Examples:
      lariat bench paper horizon --method gauss_newton --nodes 20 40 80 --errors
      lariat bench paper horizon --calls 0 --errors three-cylinders cable --plant rod links

    Args:
        method: Control methods to time.
        nodes: Numbers of nodes of the rope to time.
        calls: Number of timed horizons for each method and number of nodes.
        errors: Names of the shipped scenarios whose predictions are measured.
        plant: Simulators of the true rope for the errors.

    Returns:
        0 if every prediction error is at most twice the noise, else 1.
    """
    tables = []
    if calls:
        times = [_row(name, n, planning_times(name, n, calls)) for n in nodes for name in method]
        notes = "plant = model (Lariat's rod), state known, not adapting; the paper: 1700 ms, GPU"
        tables.append(Result("times", times, notes))
    specs = [ErrorSpec(name, model) for name in errors for model in plant]
    measured = CAMPAIGN_DEFAULTS.trials(horizon_errors, specs)
    if errors:
        meaning = "rms distance of horizons' ends, and of perceived nodes, from the moving rope"
        tables.append(Result("errors", measured, meaning))
    options.publish(*tables)
    good = [trial["ratio"] <= MAX_NOISE_RATIO for trial in measured]
    return 0 if all(good) and len(good) == len(specs) else 1


def _row(method: Method, nodes: int, times: Float64[np.ndarray, "c"]) -> dict[str, object]:
    p50, p99, longest = np.quantile(times, [0.5, 0.99, 1.0]).round(3).tolist()
    return {"method": method, "nodes": nodes, "p50_ms": p50, "p99_ms": p99, "max_ms": longest}


def horizon_errors(spec: ErrorSpec) -> Trial:
    """Run a scenario with the camera and measure its horizons while the rope moves.

    `error_mm` is the root mean square node distance of the true rope from the ends of the horizons,
    `noise_mm` that from the perceived rope.

    Raises:
        ValueError: The rope did not move.
    """
    name = spec.scenario
    model = [] if spec.model == "as shipped" else [f"plant.model={spec.model}"]
    scenario = load_with(Path(name), ["sensing.source=camera", *model])
    score, conditions = closed_loop.run(scenario).score, Conditions.of(scenario)
    error, noise = score.horizon_error_mm, score.sensing_error_mm
    if error is None or noise is None:
        raise ValueError(f"the rope of {name} did not move; `lariat run {name}` says why")
    return {
        "plant": conditions.plant,
        "adapting": conditions.adapting,
        "error_mm": error,
        "noise_mm": noise,
        "ratio": error / noise,
    }


def planning_times(method: Method, count: int, calls: int) -> Float64[np.ndarray, "c"]:
    """Return the wall times of successive horizons of a rope with some number of nodes [ms].

    Raises:
        ValueError: The method lost the rope.
    """
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
    horizon = optimizer.step_count
    avoidance = AvoidanceSpecification(
        scenario.bodies, scenario.control.clearance, scenario.rope.diameter / 2.0, MAX_GRIP_DISTANCE
    )
    velocity = np.zeros((2, 2, 3))
    times = []
    for k in range(calls + WARM_UP_CALLS):
        if k == calls // 2:
            state, velocity = start, 0.0 * velocity
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
        moved = RolloutSpec(state, velocity.reshape(1, 2, 6), CALL_PERIOD / 4.0, steps=4)
        state = rod.rollout(moved).final
    if not np.all(np.isfinite(state.positions)):
        raise ValueError(f"{method} with {count} nodes lost the rope")
    return np.array(times[WARM_UP_CALLS:])
