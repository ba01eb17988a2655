"""The paper's rod against the continuous one, and its parameters against their meaning."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle, pack, signed_distance
from lariat.geometry.poses import Pose
from lariat.paper.xpbd import XpbdProperties, XpbdRod
from lariat.rod import Rod, RolloutSpec

PROPERTIES = XpbdProperties(0.45, 0.008)
ALONG_X = np.array([0.5, 0.5, 0.5, 0.5])
LEFT = Pose(np.array([-0.2, 0.0, 0.3]), ALONG_X)
RIGHT = Pose(np.array([0.2, 0.0, 0.3]), ALONG_X)


def test_converged_sweeps_have_the_equilibrium_of_the_continuous_rod() -> None:
    many = XpbdRod(PROPERTIES, 20, iterations=1000).rest(LEFT, RIGHT)
    exact = Rod(PROPERTIES.material(20), 20).rest(LEFT, RIGHT)
    assert many.converged
    misses = np.linalg.norm(many.state.positions - exact.state.positions, axis=1)
    assert np.max(misses) < 3e-4


def test_a_shape_at_rest_does_not_move() -> None:
    rod = XpbdRod(PROPERTIES, 40)
    rest = rod.rest(LEFT, RIGHT)
    rolled = rod.rollout(RolloutSpec(rest.state, np.zeros((1, 2, 6)), 0.01, steps=50))
    assert np.max(np.abs(rolled.positions - rest.state.positions)) < 1e-8


def test_a_curved_rod_that_is_bent_the_other_way_returns() -> None:
    curved = replace(PROPERTIES, rest_curvature=((0.0, 4.0, 0.0),))
    rod = XpbdRod(curved, 15, right="free", gravity=(0.0, 0.0, 0.0), iterations=200)
    grip = Pose(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    unloaded = rod.rest(grip, grip).state
    mirror = np.array([-1.0, 1.0, 1.0])
    # Turns about the y axis change their sign with x.
    other_way = replace(
        unloaded,
        positions=unloaded.positions * mirror,
        orientations=unloaded.orientations * np.array([1.0, 1.0, -1.0, 1.0]),
    )
    assert np.ptp(unloaded.positions[:, 0]) > 0.3 * curved.length
    returned = rod.rest(grip, grip, guess=other_way).state
    assert np.allclose(returned.positions, unloaded.positions, atol=1e-4 * curved.length)


def test_the_common_scale_of_the_parameters_has_no_effect() -> None:
    scaled = replace(PROPERTIES, mass=1.5, inertia=0.15, bending_compliance=0.001)
    actions = np.zeros((30, 2, 6))
    actions[:, 1] = [-0.3, 0.3, 0.0, 0.0, 1.0, 0.0]
    state = XpbdRod(PROPERTIES, 20).rest(LEFT, RIGHT).state
    one, other = (
        XpbdRod(p, 20).rollout(RolloutSpec(state, actions, 0.01)) for p in (PROPERTIES, scaled)
    )
    assert np.allclose(one.positions, other.positions, atol=1e-12)


def test_damping_removes_its_share_of_velocity_in_a_second() -> None:
    rod = XpbdRod(PROPERTIES, 10, "free", "free", gravity=(0.0, 0.0, 0.0))
    state = rod.straight([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    state = replace(state, velocities=np.tile([0.0, 1.0, 0.0], (10, 1)))
    final = rod.rollout(RolloutSpec(state, np.zeros((1, 2, 6)), 0.01, steps=100)).final
    assert final.velocities[:, 1] == pytest.approx(1.0 - PROPERTIES.linear_damping, rel=1e-9)


BAR = Obstacle("cylinder", (0.0, 0.0, 0.2), radius=0.03, height=0.3)


def thrown(speed: float, steps: int) -> Float64[np.ndarray, "H 40 3"]:
    """Nodes of a free rod thrown at the bar [m/s]."""
    rod = XpbdRod(PROPERTIES, 40, "free", "free", gravity=(0.0, 0.0, 0.0))
    state = rod.straight([-0.225, 0.06, 0.2], [0.225, 0.06, 0.2])
    state = replace(state, velocities=np.tile([0.0, -speed, 0.0], (40, 1)))
    still = np.zeros((1, 2, 6))
    return rod.rollout(
        RolloutSpec(state, still, 0.01, steps=steps, obstacles=pack([BAR]))
    ).positions


def test_a_rod_thrown_at_an_obstacle_stays_outside() -> None:
    least = float(np.min(signed_distance(thrown(0.2, 100), BAR)))
    # Sweeps after the prediction may press nodes in by part of the rod's radius, never through it.
    assert 0.25 * PROPERTIES.diameter < least < 0.51 * PROPERTIES.diameter


def test_a_node_that_would_pass_through_an_obstacle_in_a_step_is_held_at_its_entry() -> None:
    assert np.all(thrown(12.0, 1)[0, 18:22, 1] > 0.02)


def test_bad_input_is_rejected_by_name() -> None:
    rod = XpbdRod(PROPERTIES, 10)
    state = rod.straight([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    still = np.zeros((1, 2, 6))
    with pytest.raises(ValueError, match=r"bending_compliance.*-1"):
        replace(PROPERTIES, bending_compliance=-1.0)
    with pytest.raises(ValueError, match="linear_damping"):
        replace(PROPERTIES, linear_damping=1.0)
    with pytest.raises(ValueError, match=r"actions.*finite"):
        rod.rollout(RolloutSpec(state, np.nan * still, 0.01))
    with pytest.raises(ValueError, match=r"dt.*\[0\.01\]"):
        rod.rollout(RolloutSpec(state, still, np.array([0.01])))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="a batch of 2"):
        rod.rollout(RolloutSpec([state, state], np.stack([still, still]), 0.01))  # type: ignore[arg-type]
    wrong = replace(state, positions=np.zeros((9, 3)))
    with pytest.raises(ValueError, match=r"state\.positions.*\(10, 3\)"):
        rod.rollout(RolloutSpec(wrong, still, 0.01))
    with pytest.raises(ValueError, match="the ends are"):
        rod.rest(LEFT, Pose(np.array([0.9, 0.0, 0.3]), ALONG_X))
    with pytest.raises(ValueError, match="no parameter 'stiffness'"):
        rod.gradient(RolloutSpec(state, still, 0.01), np.zeros((1, 10, 3)), ("stiffness",))
