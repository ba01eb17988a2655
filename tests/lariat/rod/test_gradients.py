"""Every derivative against fourth-order finite differences of the roll-out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import TABLE, Obstacle, pack
from lariat.rod import PARAMETERS, Rod, RodProperties, RodState, RolloutSpec, StateDirections
from lariat.rod.integration_schemes import Scheme

PROPERTIES = RodProperties(
    0.45,
    0.008,
    0.044,
    1e6,
    internal_damping=0.004,
    drag_coefficient=5.0,
    stiffness_profile=(1.2, 0.9, 1.1),
    density_profile=(0.8, 1.1),
    rest_curvature=((1.0, 0.5, 0.3), (0.5, -0.5, 0.6)),
)
ALL_PARAMETERS = (*PARAMETERS, "stiffness_profile[1]", "density_profile[0]", "rest_curvature[1][0]")
HORIZONTAL = (0.7071067811865476, 0.7071067811865476, 0.0, 0.0)
BAR = pack([Obstacle("cylinder", (0.0, 0.0, 0.25), HORIZONTAL, radius=0.03, height=0.2), TABLE])
CONE = pack([Obstacle("cone", (0.02, 0.0, 0.22), radius=0.06, height=0.12), TABLE])
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
        scheme: Scheme = "euler",
    ) -> None:
        rng = np.random.default_rng(node_count)
        self.rod = Rod(PROPERTIES, node_count, left, right, tolerance=1e-10, scheme=scheme)
        self.options = {
            "block_of_step": np.array([0, 0, 1, 1, 2, 2]),
            "substeps": substeps,
            "obstacles": obstacles,
        }
        moving = np.zeros((8, 2, 6))
        moving[:, 1] = [-1.2, 0.0, 0.0, 2.0, 0.0, 2.0]
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
        rod: Rod | None = None,
    ) -> float:
        rollout = (rod or self.rod).rollout(self.spec(actions, state))
        assert rollout.converged.all()
        return float(np.sum(self.cost_gradient * rollout.positions))


def difference(function: Callable[[float], float], h: float) -> float:
    """Return the derivative at zero, to fourth order."""
    near = function(h) - function(-h)
    return (8.0 * near - (function(2.0 * h) - function(-2.0 * h))) / (12.0 * h)


def with_parameter(name: str, by: float) -> RodProperties:
    p = PROPERTIES
    if name == "bending_stiffness":
        return p.with_stiffness(p.bending_stiffness * (1.0 + by), p.twisting_stiffness)
    if name == "twisting_stiffness":
        return p.with_stiffness(p.bending_stiffness, p.twisting_stiffness * (1.0 + by))
    if name.startswith("rest"):
        rest = np.array(p.rest_curvature)
        if name.endswith("]"):
            rest[1, 0] += by
        else:
            rest[:, PARAMETERS.index(name) - PARAMETERS.index("rest_curvature_1")] += by
        return replace(p, rest_curvature=tuple(map(tuple, rest)))
    if name == "stiffness_profile[1]":
        first, middle, last = p.stiffness_profile
        return replace(p, stiffness_profile=(first, middle + by, last))
    if name == "density_profile[0]":
        first, last = p.density_profile
        return replace(p, density_profile=(first + by, last))
    return replace(p, **{name: getattr(p, name) * (1.0 + by)})


SCENES = {
    "free space": lambda: Scene(40),
    "contact": lambda: Scene(40, BAR),
    "coarse": lambda: Scene(10, BAR),
    "cone": lambda: Scene(40, CONE),
    "pinned and free, two substeps": lambda: Scene(10, None, "pinned", "free", 2),
    "second order, contact": lambda: Scene(10, BAR, substeps=2, scheme="sdirk2"),
}


@pytest.mark.parametrize("name", SCENES)
def test_adjoint_and_sensitivities_match_differences_in_actions(name: str) -> None:
    scene = SCENES[name]()
    exact = np.zeros_like(scene.actions)
    for index in np.ndindex(*exact.shape):
        bump = np.zeros_like(exact)
        bump[index] = 1.0

        def moved(h: float, bump: Float64[np.ndarray, "K 2 6"] = bump) -> float:
            return scene.cost(actions=scene.actions + h * bump)

        exact[index] = difference(moved, 1e-4)
    adjoint = scene.rod.gradient(scene.spec(), scene.cost_gradient).actions
    forward = scene.rod.linearize(scene.spec())
    swept = np.einsum("hni,hnikea->kea", scene.cost_gradient, forward.d_positions_d_actions)
    scale = np.linalg.norm(exact)
    assert np.linalg.norm(adjoint - exact) < 1e-7 * scale
    assert np.linalg.norm(swept - exact) < 1e-7 * scale


@pytest.mark.parametrize("name", SCENES)
def test_adjoint_and_sensitivities_match_differences_in_parameters(name: str) -> None:
    scene = SCENES[name]()
    found = scene.rod.gradient(scene.spec(), scene.cost_gradient, ALL_PARAMETERS).parameters
    forward = scene.rod.linearize(scene.spec(), ALL_PARAMETERS)
    swept = np.einsum("hni,hnip->p", scene.cost_gradient, forward.d_positions_d_parameters)
    for k, parameter in enumerate(ALL_PARAMETERS):
        absolute = parameter.startswith("rest") or "[" in parameter
        value = 1.0 if absolute else getattr(PROPERTIES, parameter)

        def changed(h: float, parameter: str = parameter) -> float:
            return scene.cost(rod=scene.rod.with_properties(with_parameter(parameter, h)))

        # A longer rod slides along its contacts: small steps.
        step = 2e-6 if parameter == "length" else 1e-3
        exact = difference(changed, step) / value
        assert found[parameter] == pytest.approx(exact, rel=1e-6), parameter
        assert swept[k] == pytest.approx(exact, rel=1e-6), parameter


def test_the_gradient_in_the_state_outlives_the_next_launch() -> None:
    scene = SCENES["free space"]()
    read_at_once = scene.rod.gradient(scene.spec(), scene.cost_gradient).state
    read_later = scene.rod.gradient(scene.spec(), scene.cost_gradient)
    scene.rod.gradient(scene.spec(), -scene.cost_gradient)
    assert np.array_equal(read_later.state.positions, read_at_once.positions)
    assert np.array_equal(read_later.state.velocities, read_at_once.velocities)


@pytest.mark.parametrize(
    "name", ["contact", "pinned and free, two substeps", "second order, contact"]
)
def test_adjoint_matches_differences_in_the_state(name: str) -> None:
    scene = SCENES[name]()
    found = scene.rod.gradient(scene.spec(), scene.cost_gradient).state
    rng = np.random.default_rng(1)
    # Rotations of edges hardly move nodes, so that their differences drown sooner.
    for part, h, within in (
        ("positions", 1e-6, 1e-7),
        ("velocities", 1e-4, 1e-7),
        ("angular_velocities", 1e-1, 1e-5),
        ("rotations", 1e-4, 1e-4),
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
        assert abs(np.sum(gradient * direction) - exact) < within * scale, part


@pytest.mark.parametrize(
    "name", ["contact", "pinned and free, two substeps", "second order, contact"]
)
def test_sensitivities_to_the_state_match_the_adjoint(name: str) -> None:
    scene = SCENES[name]()
    rng = np.random.default_rng(3)
    n, frames = scene.rod.node_count, scene.rod.model.frame_count
    along = StateDirections(
        rng.normal(size=(7, n, 3)),
        rng.normal(size=(7, frames, 3)),
        rng.normal(size=(7, n, 3)),
        rng.normal(size=(7, frames, 3)),
    )
    swept = scene.rod.linearize(
        scene.spec(), ALL_PARAMETERS, state_directions=along, with_actions=False
    ).d_positions_d_state
    gradient = scene.rod.gradient(scene.spec(), scene.cost_gradient).state
    expected = sum(
        np.einsum("ni,dni->d", getattr(gradient, part), getattr(along, part))
        for part in ("positions", "rotations", "velocities", "angular_velocities")
    )
    found = np.einsum("hni,hnid->d", scene.cost_gradient, swept)
    assert np.allclose(found, expected, rtol=1e-9, atol=1e-9 * np.linalg.norm(expected))


def test_a_free_end_ignores_its_actions() -> None:
    scene = Scene(10, None, "pinned", "free")
    forward = scene.rod.linearize(scene.spec())
    assert not np.any(forward.d_positions_d_actions[:, :, :, :, 1])
    assert np.any(forward.d_positions_d_actions[:, :, :, :, 0, :3])


def test_a_batch_equals_its_rods_one_by_one() -> None:
    scene = Scene(10, BAR)
    actions = np.stack([scene.actions, -scene.actions])
    batch = RolloutSpec([scene.state] * 2, actions, DT, **scene.options)
    both = scene.rod.linearize(batch)
    for found, alone in zip(both, actions, strict=True):
        expected = scene.rod.linearize(scene.spec(alone))
        assert np.array_equal(found.rollout.positions, expected.rollout.positions)
        assert np.array_equal(found.d_positions_d_actions, expected.d_positions_d_actions)
