"""Algorithm 2 of the paper: plan a horizon, execute it, observe, adapt, repeat.

The ends follow the planned velocities exactly, without limits of a gripper. The optimizers are
those of the controller: `PaperOptimizer` with its policies, or `GaussNewton`.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float64

from benchmarks.paper.goals import Nodes, start_state
from lariat.control.mpc.collision_avoidance import AvoidanceSpecification
from lariat.control.mpc.horizon import HorizonOptimizer, HorizonProblem
from lariat.geometry import polylines
from lariat.geometry.obstacles import chain_clearance, pack
from lariat.paper.adaptation import PaperAdaptation
from lariat.paper.xpbd import PARAMETERS, XpbdRod
from lariat.rod import Rod, RodState, RolloutSpec

PAPER_TIME_STEP = 0.01
"""Time step of the paper [s]."""
FINAL_STEPS = 20
"""Number of steps over which the final error is averaged."""


def run_to_goal(
    method: HorizonOptimizer,
    model: Rod | XpbdRod,
    plant: Rod | XpbdRod,
    goal: Nodes,
    avoidance: AvoidanceSpecification,
    steps: int,
    adaptation: PaperAdaptation | None = None,
) -> dict[str, Any]:
    """Move the plant's rope from rest at the start towards a goal, in steps of 10 ms.

    If model and plant are the same rod, the model knows the whole state, as in the paper's
    simulations. Otherwise it observes the nodes at the end of each horizon and keeps its own
    orientations.

    Returns `errors_mm`, mean node distances to the goal after every step; `clearance_mm`, least
    distance of the surfaces of rope and obstacles; `length_error_mm`, largest deviation from the
    rest length; `horizon_ms`, median and 99th percentile of planning a horizon; `prediction_mm`,
    mean distance of predicted and true rope at the ends of the horizons of the second half;
    `adaptation_ms`, median of the adaptations; `parameters`, the adapted ones.
    """
    obstacles = pack(avoidance.obstacles)
    everywhere = np.ones(model.node_count, dtype=bool)
    state = believed = start_state(plant)
    velocity = np.zeros((2, 2, 3))
    errors, lengths, times, adapting, prediction_errors = [], [], [], [], []
    clearance = np.inf
    while len(errors) < steps:
        started = time.process_time()
        horizon = horizon_problem(method, believed, goal, velocity)
        plan = method.plan(model, horizon, avoidance)
        times.append(time.process_time() - started)
        actions, velocity = _executed_actions(method, plan.velocities, velocity)
        rolled = plant.rollout(RolloutSpec(state, actions, PAPER_TIME_STEP, obstacles=obstacles))
        method.shift(PAPER_TIME_STEP * len(actions))
        for nodes in rolled.positions:
            errors.append(float(np.mean(np.linalg.norm(nodes - goal, axis=1))))
            lengths.append(abs(polylines.length(nodes) - plant.properties.length))
            nearest = chain_clearance(nodes, avoidance.radius, avoidance.obstacles)
            clearance = min(clearance, nearest)
        before, state = state, rolled.final
        spec = RolloutSpec(believed, actions, PAPER_TIME_STEP, obstacles=obstacles)
        expected = model.rollout(spec).final
        distances = np.linalg.norm(expected.positions - state.positions, axis=1)
        prediction_errors.append(float(np.mean(distances)))
        if adaptation is not None:
            started = time.process_time()
            adaptation.adapt(
                believed, actions, PAPER_TIME_STEP, state.positions, everywhere, obstacles
            )
            model = adaptation.rod
            adapting.append(time.process_time() - started)
        believed = state
        if plant is not model:
            moved = (state.positions - before.positions) / (PAPER_TIME_STEP * len(actions))
            believed = replace(expected, positions=state.positions, velocities=moved)
    p50, p99 = 1e3 * np.quantile(times, [0.5, 0.99])
    second_half = prediction_errors[len(prediction_errors) // 2 :]
    return {
        "errors_mm": (1e3 * np.array(errors)).tolist(),
        "clearance_mm": 1e3 * clearance,
        "length_error_mm": 1e3 * max(lengths),
        "horizon_ms": (float(p50), float(p99)),
        "prediction_mm": 1e3 * float(np.mean(second_half)),
        "adaptation_ms": 1e3 * float(np.median(adapting)) if adaptation else None,
        "parameters": {n: getattr(adaptation.properties, n) for n in PARAMETERS}
        if adaptation
        else {},
    }


def horizon_problem(
    method: HorizonOptimizer,
    state: RodState,
    goal: Nodes,
    velocity: Float64[np.ndarray, "2 2 3"],
) -> HorizonProblem:
    """Return the problem of a horizon whose reference is the goal itself, without a path."""
    count = method.step_count
    return HorizonProblem(
        state,
        np.zeros_like(goal),
        np.zeros((count, 2, 6)),
        np.repeat(goal[None], count, axis=0),
        velocity,
        np.zeros((2, 6)),
        np.zeros((2, 6), dtype=bool),
    )


def _executed_actions(
    method: HorizonOptimizer,
    planned: Float64[np.ndarray, "h 2 2 3"],
    previous: Float64[np.ndarray, "2 2 3"],
) -> tuple[Float64[np.ndarray, "k 2 6"], Float64[np.ndarray, "2 2 3"]]:
    """Mean velocities of the ends in the steps of 10 ms until the next plan, and those at its time.

    The planned ones are those at the ends of the planner's steps [m/s, rad/s].
    """
    executed = planned[: method.executed_step_count]
    count = round(method.time_step / PAPER_TIME_STEP)
    if method.interpolation == "constant":
        return np.repeat(executed, count, axis=0).reshape(-1, 2, 6), executed[-1]
    starts = np.concatenate([previous[None], executed[:-1]])[:, None]
    shares = ((np.arange(count) + 0.5) / count)[:, None, None, None]
    velocities = (1.0 - shares) * starts + shares * executed[:, None]
    return velocities.reshape(-1, 2, 6), executed[-1]
