"""Every derivative of the paper's rod against fourth-order differences of its own roll-out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import TABLE, Obstacle, pack
from lariat.paper.xpbd import PARAMETERS, XpbdProperties, XpbdRod
from lariat.rod import RodState, RolloutSpec

PROPERTIES = XpbdProperties(0.45, 0.008, rest_curvature=((1.0, 0.5, 0.3),))
HORIZONTAL = (0.7071067811865476, 0.7071067811865476, 0.0, 0.0)
BAR = pack([Obstacle("cylinder", (0.0, 0.0, 0.25), HORIZONTAL, radius=0.03, height=0.2), TABLE])
BODIES = pack(
    [
        Obstacle("sphere", (-0.1, 0.0, 0.26), radius=0.03),
        Obstacle("box", (0.0, 0.0, 0.26), (0.9238795, 0.0, 0.3826834, 0.0), size=(0.05, 0.1, 0.05)),
        Obstacle("capsule", (0.1, 0.0, 0.26), HORIZONTAL, radius=0.03, height=0.1),
        Obstacle("cone", (0.18, 0.0, 0.22), radius=0.06, height=0.12),
    ]
)
DT = 0.01


class Scene:
    """Rod in motion, and a linear cost of its next positions."""

    def __init__(
        self,
        node_count: int,
        obstacles: Float64[np.ndarray, "m 13"] | None = None,
        left: str = "clamped",
        right: str = "clamped",
        substeps: int = 1,
        contact_compliance: float = 0.0,
    ) -> None:
        rng = np.random.default_rng(node_count)
        self.properties = replace(PROPERTIES, contact_compliance=contact_compliance)
        self.rod = XpbdRod(self.properties, node_count, left, right, iterations=8)
        self.options = {
            "block_of_step": np.array([0, 0, 1, 1, 2, 2]),
            "substeps": substeps,
            "obstacles": obstacles,
        }
        moving = np.zeros((12, 2, 6))
        moving[:, 1] = [-0.8, 0.0, 0.0, 2.0, 0.0, 2.0]
        moving[:, 0] = [0.0, 0.3, 0.0, 0.0, 1.0, 0.0]
        start = self.rod.straight([-0.225, 0.0, 0.3], [0.225, 0.0, 0.3])
        self.state = self.rod.rollout(RolloutSpec(start, moving, DT, obstacles=obstacles)).final
        self.actions = 0.5 * rng.normal(size=(3, 2, 6))
        self.cost_gradient = rng.normal(size=(6, node_count, 3))

    def spec(
        self,
        actions: Float64[np.ndarray, "K 2 6"] | None = None,
        state: RodState | None = None,
    ) -> RolloutSpec[RodState]:
        return RolloutSpec(
            self.state if state is None else state,
            self.actions if actions is None else actions,
            DT,
            **self.options,
        )

    def cost(
        self,
        actions: Float64[np.ndarray, "K 2 6"] | None = None,
        state: RodState | None = None,
        rod: XpbdRod | None = None,
    ) -> float:
        rollout = (rod or self.rod).rollout(self.spec(actions, state))
        return float(np.sum(self.cost_gradient * rollout.positions))

    def gradient(self):
        return self.rod.gradient(self.spec(), self.cost_gradient)


def difference(function: Callable[[float], float], h: float) -> float:
    """Return the derivative at zero, to fourth order."""
    near = function(h) - function(-h)
    return (8.0 * near - (function(2.0 * h) - function(-2.0 * h))) / (12.0 * h)


SCENES = {
    "free space": lambda: Scene(40),
    "bar": lambda: Scene(40, BAR),
    "bodies": lambda: Scene(40, BODIES),
    "coarse, soft contact": lambda: Scene(10, BAR, contact_compliance=1e-5),
    "pinned and free, two substeps": lambda: Scene(10, None, "pinned", "free", 2),
}


@pytest.mark.parametrize("name", SCENES)
def test_the_adjoint_matches_differences_in_actions(name: str) -> None:
    scene = SCENES[name]()
    exact = np.zeros_like(scene.actions)
    for index in np.ndindex(*exact.shape):
        bump = np.zeros_like(exact)
        bump[index] = 1.0

        def moved(h: float, bump: Float64[np.ndarray, "K 2 6"] = bump) -> float:
            return scene.cost(actions=scene.actions + h * bump)

        exact[index] = difference(moved, 1e-4)
    assert np.linalg.norm(scene.gradient().actions - exact) < 1e-7 * np.linalg.norm(exact)


@pytest.mark.parametrize("name", SCENES)
def test_the_adjoint_matches_differences_in_parameters(name: str) -> None:
    scene = SCENES[name]()
    found = scene.gradient().parameters
    for parameter in PARAMETERS:
        value = getattr(scene.properties, parameter)

        def changed(h: float, parameter: str = parameter, value: float = value) -> float:
            properties = replace(scene.properties, **{parameter: value * (1.0 + h)})
            return scene.cost(rod=scene.rod.with_properties(properties))

        exact = difference(changed, 1e-4) / value
        assert found[parameter] == pytest.approx(exact, rel=1e-6, abs=1e-9), parameter


@pytest.mark.parametrize("name", SCENES)
def test_the_adjoint_matches_differences_in_the_state(name: str) -> None:
    scene = SCENES[name]()
    found = scene.gradient().state
    rng = np.random.default_rng(1)
    for part, h in (
        ("positions", 1e-7),
        ("velocities", 1e-5),
        ("angular_velocities", 1e-3),
        ("rotations", 1e-5),
    ):
        gradient = getattr(found, part)
        direction = rng.normal(size=gradient.shape)

        def moved(
            h: float, part: str = part, direction: Float64[np.ndarray, "m 3"] = direction
        ) -> float:
            if part == "rotations":
                turned = poses.multiply(poses.exponential(h * direction), scene.state.orientations)
                return scene.cost(state=replace(scene.state, orientations=turned))
            value = getattr(scene.state, part) + h * direction
            return scene.cost(state=replace(scene.state, **{part: value}))

        exact = difference(moved, h)
        scale = np.linalg.norm(gradient) * np.linalg.norm(direction)
        assert abs(np.sum(gradient * direction) - exact) < 1e-6 * scale, part


def test_a_cost_gradient_may_be_a_function_of_the_positions() -> None:
    scene = Scene(10, BAR)
    goal = 0.9 * scene.state.positions

    def cost_gradient(positions: Float64[np.ndarray, "H n 3"]) -> Float64[np.ndarray, "H n 3"]:
        return positions - goal

    rollout = scene.rod.rollout(scene.spec())
    given = scene.rod.gradient(scene.spec(), cost_gradient(rollout.positions))
    called = scene.rod.gradient(scene.spec(), cost_gradient)
    assert np.array_equal(given.actions, called.actions)
    assert given.parameters == called.parameters
