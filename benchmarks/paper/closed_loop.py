"""Algorithm 2 of the paper: plan a horizon, execute it all, look, adapt, go on.

The ends follow the velocities directly; no gripper's limits stand between. What plans is the
controller's own: `PaperOptimizer` with its policies, or `GaussNewton`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64

from benchmarks.paper.goals import Goal
from lariat.geometry import polylines
from lariat.geometry.obstacles import chain_clearance, pack
from lariat.rod import Rod, RodState, RolloutSpec
from lariat.rod.xpbd import PARAMETERS, XpbdProperties, XpbdRod
from services.controller.mpc.collision_avoidance import AvoidanceSpecification
from services.controller.mpc.horizon import HorizonOptimizer, HorizonProblem
from services.controller.paper.adaptation import PaperAdaptation

STEP = 0.01
"""The paper's time step [s]."""


@dataclass(frozen=True)
class Run:
    """One goal."""

    errors: Float64[np.ndarray, "T"]
    """Mean node distance to the goal after every step [m]."""
    clearance: float
    """Least distance of surfaces over the run, over segments [m]."""
    length_error: float
    """Largest deviation from the rest length [m]."""
    horizon_times: Float64[np.ndarray, "h"]
    """CPU time of planning, kernels and all [s]."""
    adaptation_times: Float64[np.ndarray, "h"]
    """CPU time of adapting [s]."""
    prediction_errors: Float64[np.ndarray, "h"]
    """Mean node distance of what was predicted for the end of a horizon and what came [m]."""
    parameters: dict[str, float]
    """Adapted ones, at the end."""

    @property
    def final_error(self) -> float:
        """Mean over the last 0.2 s [m]."""
        return float(np.mean(self.errors[-20:]))


def shape(
    method: HorizonOptimizer,
    model: Rod | XpbdRod,
    plant: Rod | XpbdRod,
    goal: Goal,
    start: RodState,
    avoidance: AvoidanceSpecification,
    steps: int,
    adaptation: PaperAdaptation | None = None,
    progress: Callable[[float], None] = lambda error: None,
) -> Run:
    """Brings the plant's rope from its start towards a goal.

    Where model and plant are one rod, the model knows the whole state, as in the paper's
    simulations. Else it sees nodes at the end of each horizon, and keeps its own orientations.

    Args:
        steps: T, of 10 ms.
        progress: Told of the error after every horizon [m].
    """
    obstacles = pack(avoidance.obstacles)
    everywhere = np.ones(model.node_count, dtype=bool)
    state = believed = start
    velocity = np.zeros((2, 2, 3))
    errors, lengths, times, adapting, misses = [], [], [], [], []
    clearance = np.inf
    while len(errors) < steps:
        begun = time.process_time()
        horizon = horizon_of(method, believed, goal, velocity)
        plan = method.plan(model, horizon, avoidance)
        times.append(time.process_time() - begun)
        actions, velocity = _executed(method, plan.velocities, velocity)
        rolled = plant.rollout(RolloutSpec(state, actions, STEP, obstacles=obstacles))
        method.shift(STEP * len(actions))
        for nodes in rolled.positions:
            errors.append(float(np.mean(np.linalg.norm(nodes - goal.nodes, axis=1))))
            lengths.append(abs(polylines.length(nodes) - plant.properties.length))
            nearest = chain_clearance(nodes, avoidance.radius, avoidance.obstacles)
            clearance = min(clearance, nearest)
        before, state = state, rolled.final
        spec = RolloutSpec(believed, actions, STEP, obstacles=obstacles)
        expected = model.rollout(spec).final
        miss = np.linalg.norm(expected.positions - state.positions, axis=1)
        misses.append(float(np.mean(miss)))
        if adaptation is not None and isinstance(model, XpbdRod):
            begun = time.process_time()
            adaptation.adapt(believed, actions, STEP, state.positions, everywhere, obstacles)
            model = model.with_properties(adaptation.properties)
            adapting.append(time.process_time() - begun)
        believed = state
        if plant is not model:
            moved = (state.positions - before.positions) / (STEP * len(actions))
            believed = replace(expected, positions=state.positions, velocities=moved)
        progress(errors[-1])
    return Run(
        np.array(errors),
        clearance,
        max(lengths),
        np.array(times),
        np.array(adapting),
        np.array(misses),
        {} if adaptation is None else _numbers(adaptation.properties),
    )


def horizon_of(
    method: HorizonOptimizer,
    state: RodState,
    goal: Goal,
    velocity: Float64[np.ndarray, "2 2 3"],
) -> HorizonProblem:
    """The goal itself is the reference, and no path leads to it."""
    count = method.step_count
    return HorizonProblem(
        state,
        np.zeros_like(goal.nodes),
        np.zeros((count, 2, 6)),
        np.repeat(goal.nodes[None], count, axis=0),
        velocity,
        np.zeros((2, 6)),
        np.zeros((2, 6), dtype=bool),
    )


def _executed(
    method: HorizonOptimizer,
    planned: Float64[np.ndarray, "h 2 2 3"],
    before: Float64[np.ndarray, "2 2 3"],
) -> tuple[Float64[np.ndarray, "k 2 6"], Float64[np.ndarray, "2 2 3"]]:
    """Velocities of the ends in the steps until the next plan, and at their end.

    A horizon in the paper's own steps is executed whole, as the paper does. Gauss-Newton plans
    velocities that are linear in time over longer steps, and plans again after the first of them.
    """
    if method.time_step == STEP:
        return planned.reshape(-1, 2, 6), planned[-1]
    count = round(method.time_step / STEP)
    shares = ((np.arange(count) + 0.5) / count)[:, None, None, None]
    between = (1.0 - shares) * before + shares * planned[0]
    return between.reshape(count, 2, 6), planned[0]


def _numbers(properties: XpbdProperties) -> dict[str, float]:
    return {name: getattr(properties, name) for name in PARAMETERS}
