"""Objective and bounds of the paper's methods."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from jaxtyping import Float64

from lariat.control.mpc.collision_avoidance import AvoidanceSpecification
from lariat.control.mpc.horizon import HorizonProblem
from lariat.geometry.obstacles import Obstacle, signed_distance
from lariat.paper.optimizer import PaperOptimizer, Policy
from lariat.paper.policies import Actions, Network
from lariat.paper.xpbd import XpbdProperties, XpbdRod
from lariat.rod import Rod, RolloutSpec
from lariat.scenario.sections import Limits, PaperControl
from tests.services.controller.cell import COUNT, PROPERTIES, grips

RODS: dict[str, Rod | XpbdRod] = {
    "direct": Rod(PROPERTIES, COUNT),
    "xpbd": XpbdRod(XpbdProperties(0.45, 0.008), COUNT),
}


@pytest.mark.parametrize("solver", RODS)
@pytest.mark.parametrize("name", ["actions", "network"])
def test_training_in_a_horizon_lowers_the_objective(name: str, solver: str) -> None:
    settings = PaperControl()
    moves = np.zeros((2, 6), dtype=bool)
    moves[:, :3] = True
    policy: Policy = Actions(settings.horizon, 6)
    if name == "network":
        policy = Network(COUNT, 6, settings.learning_rate, seed=0)
    method = PaperOptimizer(policy, settings, moves, Limits())
    rod = RODS[solver]
    state = rod.rest(*grips((-0.19, 0.0, 0.3), (0.19, 0.0, 0.3))).state
    goal = rod.rest(*grips((-0.16, 0.1, 0.25), (0.18, 0.1, 0.3))).state.positions
    still = np.zeros((settings.horizon, 2, 6))
    horizon = HorizonProblem(
        state,
        np.zeros_like(goal),
        still,
        np.repeat(goal[None], settings.horizon, axis=0),
        np.zeros((2, 2, 3)),
        np.zeros((2, 6)),
        np.zeros((2, 6), dtype=bool),
    )
    avoidance = AvoidanceSpecification((), 0.01, 0.004, 0.44)
    standing = np.linalg.norm(state.positions - goal, axis=1).sum()
    plans = [method.plan(rod, horizon, avoidance) for _ in range(2)]
    total = sum(plans[-1].cost.values())
    assert total < standing
    assert plans[-1].cost["error"] < 0.99 * standing


@pytest.mark.parametrize(("weight", "least", "most"), [(None, 0.002, 0.05), (0.0, -5e-4, 5e-4)])
def test_potential_drives_a_rope_at_its_goal_away_from_an_obstacle(
    weight: float | None, least: float, most: float
) -> None:
    settings = PaperControl()
    if weight is not None:
        settings = replace(settings, obstacle_weight=weight)
    moves = np.zeros((2, 6), dtype=bool)
    moves[:, :3] = True
    method = PaperOptimizer(Actions(settings.horizon, 6), settings, moves, Limits())
    rod = RODS["direct"]
    state = rod.rest(*grips((-0.19, 0.0, 0.3), (0.19, 0.0, 0.3))).state
    x, _, z = state.positions[COUNT // 2]
    ball = Obstacle("sphere", (x, 0.03 + 0.6 * settings.obstacle_distance, z), radius=0.03)
    goal = np.repeat(state.positions[None], settings.horizon, axis=0)
    still = np.zeros((settings.horizon, 2, 6))
    horizon = HorizonProblem(
        state,
        0.0 * goal[0],
        still,
        goal,
        np.zeros((2, 2, 3)),
        np.zeros((2, 6)),
        np.zeros((2, 6), dtype=bool),
    )
    avoidance = AvoidanceSpecification((ball,), 0.01, 0.004, 0.44)
    plan = method.plan(rod, horizon, avoidance)
    distances = [np.min(signed_distance(nodes, ball)) for nodes in (goal[0], plan.nodes[-1])]
    assert least < distances[1] - distances[0] < most


class _Feedback:
    """Policy whose velocities depend on the nodes; it keeps gradients and does not learn."""

    def __init__(self, step_count: int) -> None:
        self.gains = 0.2 * np.random.default_rng(0).normal(size=(3 * COUNT, 6))
        self.extra = np.zeros((step_count, 6))
        self.gradient = np.zeros_like(self.extra)

    def begin(self, elapsed_steps: int) -> None:
        pass

    def velocities(
        self, nodes: Float64[np.ndarray, "h n 3"], goal: Float64[np.ndarray, "n 3"]
    ) -> Float64[np.ndarray, "h m"]:
        return (nodes - goal).reshape(len(nodes), -1) @ self.gains + self.extra

    def learn(self, gradient: Float64[np.ndarray, "h m"]) -> None:
        self.gradient = gradient

    def gradient_in_nodes(
        self, gradient: Float64[np.ndarray, "h m"], nodes: Float64[np.ndarray, "h n 3"]
    ) -> Float64[np.ndarray, "h n 3"]:
        return (gradient @ self.gains.T).reshape(nodes.shape)


def test_the_gradient_through_the_inputs_is_that_of_the_closed_loop() -> None:
    settings = replace(PaperControl(), optimizer_steps=1)
    moves = np.zeros((2, 6), dtype=bool)
    moves[:, :3] = True
    policy = _Feedback(settings.horizon)
    method = PaperOptimizer(policy, settings, moves, Limits(), differentiates_inputs=True)
    rod = RODS["xpbd"]
    state = rod.rest(*grips((-0.17, 0.0, 0.3), (0.17, 0.0, 0.3))).state
    goal = state.positions + np.array([0.0, 0.02, 0.01])
    still = np.zeros((settings.horizon, 2, 6))
    horizon = HorizonProblem(
        state,
        np.zeros_like(goal),
        still,
        np.repeat(goal[None], settings.horizon, axis=0),
        np.zeros((2, 2, 3)),
        np.zeros((2, 6)),
        np.zeros((2, 6), dtype=bool),
    )
    avoidance = AvoidanceSpecification((), 0.01, 0.004, 0.44)

    def cost(step: int, component: int, h: float) -> float:
        policy.extra[:] = 0.0
        policy.extra[step, component] = h
        return sum(method.plan(rod, horizon, avoidance).cost.values())

    cost(0, 0, 0.0)
    found = policy.gradient.copy()
    method.differentiates_inputs = False
    cost(0, 0, 0.0)
    assert not np.allclose(policy.gradient, found, rtol=0.01)
    method.differentiates_inputs = True
    for step, component in ((0, 0), (0, 4), (2, 1), (4, 5)):
        h = 1e-5
        slope = (cost(step, component, h) - cost(step, component, -h)) / (2.0 * h)
        assert found[step, component] == pytest.approx(slope, rel=1e-5)


class _Outwards:
    """Policy that drives the ends apart fast, and does not learn."""

    def begin(self, elapsed_steps: int) -> None:
        pass

    def velocities(self, nodes: np.ndarray, goal: np.ndarray) -> np.ndarray:
        return np.tile([-9.0, 0.0, 1.0, 9.0, 0.0, 1.0], (len(nodes), 1))

    def learn(self, gradient: np.ndarray) -> None:
        pass

    def gradient_in_nodes(self, gradient: np.ndarray, nodes: np.ndarray) -> np.ndarray:
        return np.zeros_like(nodes)


@pytest.mark.parametrize("held", [None, 0])
def test_distance_of_the_ends_stays_bounded_for_any_policy(held: int | None) -> None:
    settings = PaperControl(optimizer_steps=1)
    moves = np.zeros((2, 6), dtype=bool)
    moves[:, :3] = True
    policy = _Outwards()
    if held is not None:
        moves[held] = False
        policy.velocities = lambda nodes, goal: np.tile([9.0, 0.0, 1.0], (len(nodes), 1))
    method = PaperOptimizer(policy, settings, moves, Limits())
    rod = RODS["direct"]
    state = rod.rest(*grips((-0.19, 0.0, 0.3), (0.19, 0.0, 0.3))).state
    still = np.zeros((settings.horizon, 2, 6))
    apart = []
    for _ in range(30):
        goal = np.repeat(state.positions[None], settings.horizon, axis=0)
        nothing = np.zeros((2, 6))
        horizon = HorizonProblem(
            state, 0.0 * goal[0], still, goal, np.zeros((2, 2, 3)), nothing, nothing > 0.0
        )
        plan = method.plan(rod, horizon, AvoidanceSpecification((), 0.01, 0.004, 0.44))
        speeds = np.linalg.norm(plan.velocities[:, :, 0], axis=2)
        assert speeds.max() <= Limits().speed + 1e-12
        actions = plan.velocities.reshape(-1, 2, 6)
        rolled = rod.rollout(RolloutSpec(state, actions, settings.time_step))
        apart += np.linalg.norm(rolled.positions[:, -1] - rolled.positions[:, 0], axis=1).tolist()
        state = rolled.final
    assert max(apart) < 0.44 + 1e-9
    assert apart[-1] > 0.4399
