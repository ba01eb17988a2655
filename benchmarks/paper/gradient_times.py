"""Times of one horizon's roll-out and gradient, by the paper's method and by Lariat's.

The rod has 40 nodes; the horizon has 5 steps of 10 ms; the ends are clamped and translate; there is
no contact. State, actions and gradient of the cost in the positions are the same for all. Times are
processor times, the least of several calls.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from jaxtyping import Float64

from benchmarks.paper.closed_loop import horizon_problem
from benchmarks.paper.goals import LEVEL_ORIENTATION, Goal, obstacles, start_state
from lariat.control.mpc.collision_avoidance import AvoidanceSpecification
from lariat.control.mpc.gauss_newton import GaussNewton
from lariat.control.mpc.objective import ObjectiveWeights
from lariat.geometry.poses import Pose
from lariat.kernel_cache import runtime
from lariat.paper.xpbd import XpbdRod
from lariat.rod import Rod, RodState, RolloutSpec
from lariat.scenario.sections import Control, Limits

STEP_COUNT, TIME_STEP = 5, 0.01
"""Number of steps of a horizon, and time step [s]."""
ADAM_ITERATIONS = 30
"""Number of gradients of one horizon of the paper, its I."""


def compare(xpbd: XpbdRod, direct: Rod) -> list[dict[str, object]]:
    """Return rows of times by reverse mode, adjoints and Gauss-Newton, and of their ratios."""
    random = np.random.default_rng(0)
    actions = np.zeros((STEP_COUNT, 2, 6))
    actions[:, :, :3] = 0.1 * random.normal(size=(STEP_COUNT, 2, 3))
    slope = random.normal(size=(STEP_COUNT, xpbd.node_count, 3))
    state, other = start_state(xpbd), start_state(direct)
    started = time.process_time()
    reverse = reverse_mode_gradient(xpbd, state, actions, slope)
    found = reverse()
    compiled = time.process_time() - started
    adjoint = xpbd.gradient(RolloutSpec(state, actions, TIME_STEP), slope)
    exact = adjoint.actions[:, :, :3]
    disagreement = float(np.linalg.norm(found - exact) / np.linalg.norm(exact))

    def by_adjoint() -> None:
        xpbd.gradient(RolloutSpec(state, actions, TIME_STEP), slope)

    def by_implicit_function() -> None:
        direct.gradient(RolloutSpec(other, actions, TIME_STEP), slope, parameters=())

    by_implicit_function()
    times = {
        "reverse": _least_time(reverse, 5),
        "adjoint": _least_time(by_adjoint, 200),
        "direct": _least_time(by_implicit_function, 200),
        "gauss_newton": _least_time(_planning(direct, other), 50),
    }
    whole = ADAM_ITERATIONS * times["reverse"]
    figures = {
        "xpbd by Taichi's reverse mode [ms]": times["reverse"],
        "xpbd by its adjoint [ms]": times["adjoint"],
        "direct by its adjoint [ms]": times["direct"],
        "a horizon of 30 by Taichi's reverse mode [ms]": whole,
        "a horizon planned by gauss_newton through direct [ms]": times["gauss_newton"],
        "reverse mode / xpbd's adjoint": times["reverse"] / times["adjoint"],
        "reverse mode / direct": times["reverse"] / times["direct"],
        "horizon by reverse mode / by gauss_newton": whole / times["gauss_newton"],
        "relative disagreement of reverse mode and adjoint": disagreement,
        "first run of reverse mode [s]": compiled,
    }
    return [{"quantity": name, "value": value} for name, value in figures.items()]


def reverse_mode_gradient(
    rod: XpbdRod,
    state: RodState,
    actions: Float64[np.ndarray, "H 2 6"],
    slope: Float64[np.ndarray, "H n 3"],
) -> Callable[[], Float64[np.ndarray, "H 2 3"]]:
    """Return a call that computes the gradient in the actions by Taichi's reverse mode.

    Args:
        rod: Rod to roll out.
        state: State at the start.
        actions: Velocities of the ends.
        slope: Gradient of the cost in the positions [1/m].
    """
    runtime.start()
    from benchmarks.paper.kernels.reverse_mode import ReverseRod

    p = rod.properties
    other = ReverseRod(
        rod.node_count,
        rod.model.iterations,
        STEP_COUNT,
        rod.edge_length,
        TIME_STEP,
        p.linear_damping,
        p.angular_damping,
    )
    other.theta.from_numpy(np.array([1.0 / p.mass, 1.0 / p.inertia, p.bending_compliance]))
    other.actions.from_numpy(actions[:, :, :3].copy())
    other.slope.from_numpy(slope)
    for field, value in (
        (other.positions, state.positions),
        (other.orientations, state.orientations),
        (other.velocities, state.velocities),
        (other.angular_velocities, state.angular_velocities),
    ):
        field.from_numpy(np.repeat(value[None], STEP_COUNT + 1, axis=0))

    def run() -> Float64[np.ndarray, "H 2 3"]:
        other.run()
        return other.actions.grad.to_numpy()

    return run


def _planning(rod: Rod, state: RodState) -> Callable[[], object]:
    """Return a call that plans a horizon of the controller, with its defaults, to a near goal."""
    control = Control()
    moves = np.zeros((2, 6), dtype=bool)
    moves[:, :3] = True
    method = GaussNewton(
        moves,
        control.horizon,
        control.time_step,
        control.iterations,
        ObjectiveWeights(control.speed_weight, control.acceleration_weight),
        Limits(),
    )
    nodes = state.positions + np.array([0.0, 0.02, 0.0])
    goal = Goal(nodes, Pose(nodes[0], LEVEL_ORIENTATION), Pose(nodes[-1], LEVEL_ORIENTATION))
    horizon = horizon_problem(method, state, goal, np.zeros((2, 2, 3)))
    length = rod.properties.length
    avoidance = AvoidanceSpecification(obstacles(), 0.012, rod.properties.diameter / 2.0, length)
    return lambda: method.plan(rod, horizon, avoidance)


def _least_time(call: Callable[[], object], count: int) -> float:
    times = []
    for _ in range(count):
        started = time.process_time()
        call()
        times.append(time.process_time() - started)
    return 1e3 * min(times)
