"""The gradient and Hessian of the plain NumPy step match its energy, and the kernel its steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.rod import Rod, RodProperties, RodState
from lariat.rod.model import End
from lariat.rod.reference import Z, energy, implicit_step
from lariat.rod.rollout_spec import RolloutSpec
from lariat.rod.twist import add_turns

DT = 0.01
PROPERTIES = RodProperties(
    0.45,
    0.008,
    0.044,
    1e6,
    damping=1.3,
    internal_damping=0.004,
    drag_coefficient=20.0,
    stiffness_profile=(1.0, 1.5),
    density_profile=(0.8, 1.2),
    rest_curvature=((1.0, -2.0, 3.0),),
)
STEEL = replace(PROPERTIES, youngs_modulus=3e8, rest_curvature=((0.0, 0.0, 0.0),))


def make_rod(
    properties: RodProperties = PROPERTIES, left: End = "clamped", right: End = "clamped"
) -> Rod:
    return Rod(properties, 9, left, right, gravity=(0.3, -0.2, -9.81), tolerance=1e-13)


def random_state(rod: Rod) -> RodState:
    """Return a curved and twisted shape in motion, whose edges differ from their orientations."""
    rng = np.random.default_rng(1)
    n, frames = rod.node_count, rod.model.frame_count
    state = rod.straight((0.0, 0.0, 0.3), (1.0, 0.2, 0.4))
    turns = poses.exponential(0.15 * rng.standard_normal((frames, 3)).cumsum(axis=0))
    orientations = poses.multiply(turns, state.orientations)
    left, right = rod.model.clamps
    edges = rod.edge_length * poses.rotate(orientations[left : frames - right], Z)
    edges[1:-1] *= 1.0 + 1e-3 * rng.standard_normal((n - 3, 1))
    return RodState(
        np.vstack([np.zeros(3), edges.cumsum(axis=0)]),
        orientations,
        0.2 * rng.standard_normal((n, 3)),
        rng.standard_normal((frames, 3)),
    )


def follow_both(rod: Rod, state: RodState, steps: int) -> tuple[RodState, RodState]:
    """Return the state after a few steps, by the kernel and by the reference."""
    actions = 0.2 * np.random.default_rng(2).standard_normal((steps, 2, 6))
    rollout = rod.linearize(RolloutSpec(state, actions, DT)).rollout
    assert rollout.converged.all()
    for action in actions:
        state = implicit_step(rod.model, state, action, DT)
    return rollout.final, state


def assert_equal(found: RodState, expected: RodState, tolerance: float) -> None:
    for name in ("positions", "orientations", "velocities", "angular_velocities"):
        here, there = getattr(found, name), getattr(expected, name)
        np.testing.assert_allclose(here, there, rtol=0.0, atol=tolerance * np.abs(there).max())


@pytest.mark.parametrize("steps", [1, 4])
@pytest.mark.parametrize("properties", [PROPERTIES, STEEL], ids=["rest curvature", "steel"])
@pytest.mark.parametrize("shape", ["straight", "curved", "twisted"])
def test_the_kernel_takes_the_steps_of_the_reference(
    shape: str, properties: RodProperties, steps: int
) -> None:
    rod = make_rod(properties)
    state = rod.straight((0.0, 0.0, 0.3), (1.0, 0.0, 0.3))
    if shape == "curved":
        state = random_state(rod)
    elif shape == "twisted":
        state = add_turns(state, 1.0)
    found, expected = follow_both(rod, state, steps)
    assert_equal(found, expected, 1e-9)


@pytest.mark.parametrize(("left", "right"), [("clamped", "free"), ("pinned", "pinned")])
def test_the_kernel_holds_ends_like_the_reference(left: End, right: End) -> None:
    rod = make_rod(left=left, right=right)
    found, expected = follow_both(rod, random_state(rod), 2)
    assert_equal(found, expected, 1e-9)


def test_the_gradient_and_hessian_are_those_of_the_energy() -> None:
    rod = make_rod()
    before = random_state(rod)
    n = rod.node_count
    rng = np.random.default_rng(3)
    x = before.positions + 0.003 * rng.standard_normal((n, 3))
    frames = poses.multiply(
        before.orientations, poses.exponential(0.1 * rng.standard_normal((n + 1, 3)))
    )
    q, grips = frames[1:-1], (frames[:1], frames[-1:])

    def at(s: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        moved = x + s.reshape(-1, 3)[::2]
        turned = poses.multiply(q, poses.exponential(s.reshape(-1, 3)[1::2]))
        strain = np.diff(moved, axis=0) / rod.edge_length - poses.rotate(turned, Z)
        tensions = rod.properties.stretch_stiffness * strain
        return energy(rod.model, before, DT, moved, turned, grips, tensions)

    _, gradient, hessian = at(np.zeros(6 * n - 3))
    for _ in range(5):
        s = rng.standard_normal(6 * n - 3)
        h = 1e-5
        derivative = (at(h * s)[0] - at(-h * s)[0]) / (2.0 * h)
        assert derivative == pytest.approx(gradient @ s, rel=1e-6)
        h = 3e-4
        second = (at(h * s)[0] - 2.0 * at(np.zeros_like(s))[0] + at(-h * s)[0]) / h**2
        assert second == pytest.approx(s @ hessian @ s, rel=1e-5)


@pytest.mark.parametrize(
    "name",
    [
        "linear_density",
        "diameter",
        "youngs_modulus",
        "poisson_ratio",
        "stretch_stiffness",
        "damping",
        "internal_damping",
    ],
)
def test_a_coefficient_that_is_off_by_a_thousandth_is_detected(name: str) -> None:
    rod = make_rod(right="free")
    state = random_state(rod)
    wrong = replace(PROPERTIES, **{name: 1.001 * getattr(PROPERTIES, name)})
    found, _ = follow_both(rod, state, 1)
    action = 0.2 * np.random.default_rng(2).standard_normal((1, 2, 6))[0]
    expected = implicit_step(replace(rod.model, properties=wrong), state, action, DT)
    with pytest.raises(AssertionError):
        assert_equal(found, expected, 1e-9)
