"""Gauss-Newton through sticking and sliding: a rope is drawn along a table until its end is at a
point."""

from __future__ import annotations

import numpy as np
import pytest
from jaxtyping import Float64

from lariat.geometry import Obstacle, pack
from lariat.rod import Rod, RodProperties, RodState, RolloutSpec

TABLE = pack([Obstacle("half_space", (0.0, 0.0, 0.0), friction=0.3)])
ROD = Rod(RodProperties(0.3, 0.008, 0.044, 1e6), 16, right="free", tolerance=1e-10)
STEP, BLOCKS, BLOCK_STEPS, RESTING_STEPS = 0.02, 4, 8, 30
"""Duration of a step [s], number of blocks of constant velocity of the grip, of steps in each, and
of steps after them."""
MAX_ITERATIONS = 15
"""Largest number of roll-outs with their derivatives."""
TOLERANCE = 1e-6
"""Distance of the free end from its point at which a task is solved [m]."""


@pytest.fixture(scope="module")
def lying() -> RodState:
    """A rope that lies slack on the table, along an arc."""
    start = ROD.straight((0.0, 0.0, 0.0045), (1.0, 0.0, 0.0045))
    bent = np.zeros((60, 2, 6))
    bent[:, 0, 0], bent[:, 0, 1], bent[:, 0, 5] = 0.03, 0.05, 0.5
    motion = ROD.rollout(RolloutSpec(start, bent, STEP, obstacles=TABLE))
    assert motion.failure is None
    return motion.final.at_rest()


def spec(lying: RodState, velocities: Float64[np.ndarray, "k 2"]) -> RolloutSpec[RodState]:
    """Roll-out while the left end moves along the table, and for a while after."""
    actions = np.zeros((BLOCKS + 1, 2, 6))
    actions[:-1, 0, :2] = velocities
    block_of_step = np.minimum(
        np.arange(BLOCKS * BLOCK_STEPS + RESTING_STEPS) // BLOCK_STEPS, BLOCKS
    )
    return RolloutSpec(lying, actions, STEP, block_of_step=block_of_step, obstacles=TABLE)


@pytest.mark.parametrize("seed", range(10))
def test_a_rope_is_drawn_to_a_point(lying: RodState, seed: int):
    random = np.random.default_rng(seed)
    heading = random.uniform(-0.6, 0.6)
    along = -0.12 * np.array([np.cos(heading), np.sin(heading)])
    drawn = along + random.normal(scale=0.06, size=(BLOCKS, 2))
    point = ROD.rollout(spec(lying, drawn)).positions[-1, -1, :2]
    velocities, misses = np.tile(along, (BLOCKS, 1)), []
    for _ in range(MAX_ITERATIONS):
        linear = ROD.linearize(spec(lying, velocities))
        residual = linear.rollout.positions[-1, -1, :2] - point
        misses.append(float(np.linalg.norm(residual)))
        if misses[-1] < TOLERANCE:
            break
        jacobian = linear.d_positions_d_actions[-1, -1, :2, :BLOCKS, 0, :2].reshape(2, -1)
        # The least change of the velocities.
        velocities = velocities - (np.linalg.pinv(jacobian) @ residual).reshape(BLOCKS, 2)
    else:
        pytest.fail(f"misses the point by {misses} m")
    moved = np.linalg.norm(np.diff(linear.rollout.positions[:, -1], axis=0), axis=1)
    # The free end slides, and then sticks.
    assert np.all(moved[:BLOCK_STEPS] > 1e-5)
    assert np.all(moved[-5:] < 1e-6)
