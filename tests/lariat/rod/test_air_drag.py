"""Drag of the air against closed forms of a straight rod that moves as a rigid body."""

from __future__ import annotations

import numpy as np
import pytest
from jaxtyping import Float64

from lariat.rod import Rod, RodProperties, RodState, RolloutSpec

LIGHT = RodProperties(0.4, 0.01, 0.004, 1e8, damping=0.0, drag_coefficient=1.1)
"""Light and stiff rod of the density of foam, 50 kg/m^3."""
SLOWING = 0.5 * 1.1 * 1.2 * 0.01 / 0.004
"""Deceleration per squared speed across the rod [1/m]."""
G = 9.81
DT = 0.002


def moved(
    velocity: tuple[float, float, float],
    duration: float,
    gravity: float = 0.0,
    direction: tuple[float, float, float] = (1.0, 0.0, 0.0),
    dt: float = DT,
) -> RodState:
    """State of a free rod that begins straight, all of it with one velocity."""
    rod = Rod(LIGHT, 11, "free", "free", gravity=(0.0, 0.0, -gravity), tolerance=1e-10)
    state = rod.straight((0.0, 0.0, 0.0), direction)
    state = RodState(
        state.positions,
        state.orientations,
        np.tile(velocity, (11, 1)).astype(float),
        np.zeros((rod.model.frame_count, 3)),
    )
    steps = round(duration / dt)
    blocks = np.zeros(steps, dtype=np.int64)
    found = rod.rollout(RolloutSpec(state, np.zeros((1, 2, 6)), dt, block_of_step=blocks))
    assert found.converged.all()
    return found.final


def test_a_rod_that_coasts_across_itself_slows_down_with_one_over_time() -> None:
    velocities = moved((0.0, 3.0, 0.0), 0.5).velocities
    expected = 3.0 / (1.0 + SLOWING * 3.0 * 0.5)
    np.testing.assert_allclose(velocities[:, 1], expected, rtol=5e-3)
    np.testing.assert_allclose(velocities[:, [0, 2]], 0.0, atol=1e-9)


def test_error_of_the_steps_is_of_first_order() -> None:
    expected = 3.0 / (1.0 + SLOWING * 3.0 * 0.5)
    coarse, fine = (
        abs(moved((0.0, 3.0, 0.0), 0.5, dt=dt).velocities[5, 1] - expected) for dt in (0.01, 0.005)
    )
    assert coarse / fine == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize("duration", [0.2, 4.0])
def test_a_level_rod_falls_towards_its_terminal_velocity(duration: float) -> None:
    terminal = np.sqrt(G / SLOWING)
    velocities = moved((0.0, 0.0, 0.0), duration, gravity=G).velocities
    expected = -terminal * np.tanh(G * duration / terminal)
    np.testing.assert_allclose(velocities[:, 2], expected, rtol=3e-3)


def test_a_rod_that_moves_along_itself_is_not_slowed() -> None:
    velocities = moved((3.0, 0.0, 0.0), 0.5).velocities
    np.testing.assert_allclose(velocities, np.tile([3.0, 0.0, 0.0], (11, 1)), atol=1e-9)


def test_a_slanting_rod_is_slowed_across_itself_alone() -> None:
    slant = np.array([0.6, 0.8, 0.0])
    final = moved((0.0, 3.0, 0.0), 0.3, direction=(0.6, 0.8, 0.0))
    along, across = components(final.velocities, slant)
    np.testing.assert_allclose(along, 3.0 * 0.8, rtol=1e-3)
    np.testing.assert_allclose(across, 1.8 / (1.0 + SLOWING * 1.8 * 0.3), rtol=2e-3)


def components(
    velocities: Float64[np.ndarray, "n 3"], axis: Float64[np.ndarray, "3"]
) -> tuple[Float64[np.ndarray, "n"], Float64[np.ndarray, "n"]]:
    """Velocities along an axis, and magnitudes of those across it [m/s]."""
    along = velocities @ axis
    return along, np.linalg.norm(velocities - along[:, None] * axis, axis=1)
