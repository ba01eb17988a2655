"""A rod conserves momentum, length and energy, rests in equilibrium, and rejects bad input."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry import polylines, poses
from lariat.geometry.obstacles import TABLE, Obstacle, chain_clearance, pack
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties, RolloutSpec
from lariat.rod.strains import curvatures, forces, moments

PROPERTIES = RodProperties(0.45, 0.008, 0.044, 1e6)
ALONG_X = poses.rotation_between(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))


def grips(span: float, height: float = 0.3) -> tuple[Pose, Pose]:
    left, right = np.array([-span / 2.0, 0.0, height]), np.array([span / 2.0, 0.0, height])
    return Pose(left, ALONG_X), Pose(right, ALONG_X)


def test_a_free_rod_keeps_its_momentum() -> None:
    rod = Rod(replace(PROPERTIES, damping=0.0), 20, "free", "free", gravity=(0.0, 0.0, 0.0))
    rng = np.random.default_rng(0)
    state = rod.straight([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    state = replace(state, velocities=rng.normal(size=(20, 3)))
    masses = np.full(20, 1.0)
    masses[[0, -1]] = 0.5
    rollout = rod.rollout(RolloutSpec(state, np.zeros((20, 2, 6)), 0.005))
    assert rollout.converged.all()
    before, after = masses @ state.velocities, masses @ rollout.final.velocities
    assert np.allclose(after, before, atol=1e-5 * np.linalg.norm(before))


def test_damping_alone_slows_a_flying_rod_as_an_implicit_step_does() -> None:
    rod = Rod(replace(PROPERTIES, damping=3.0), 10, "free", "free", gravity=(0.0, 0.0, 0.0))
    state = rod.straight([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    state = replace(state, velocities=np.tile([0.0, 0.4, 0.3], (10, 1)))
    rollout = rod.rollout(RolloutSpec(state, np.zeros((10, 2, 6)), 0.01))
    expected = np.array([0.0, 0.4, 0.3]) / 1.03**10
    assert np.allclose(rollout.final.velocities, expected, atol=1e-6)


def test_a_free_rod_keeps_spinning_about_its_axis() -> None:
    rod = Rod(replace(PROPERTIES, damping=0.0), 10, "free", "free", gravity=(0.0, 0.0, 0.0))
    state = rod.straight([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    state = replace(state, angular_velocities=np.tile([7.0, 0.0, 0.0], (9, 1)))
    rollout = rod.rollout(RolloutSpec(state, np.zeros((10, 2, 6)), 0.01))
    assert np.allclose(rollout.final.angular_velocities, [7.0, 0.0, 0.0], atol=1e-6)


def test_clamps_hold_the_end_nodes_and_their_frames() -> None:
    rod = Rod(PROPERTIES, 40)
    actions = np.zeros((12, 2, 6))
    actions[:, 1] = [-0.4, 0.1, 0.2, 1.0, -2.0, 0.5]
    state = rod.straight([-0.225, 0.0, 0.3], [0.225, 0.0, 0.3])
    final = rod.rollout(RolloutSpec(state, actions, 0.01)).final
    turn = poses.exponential(0.12 * np.array([1.0, -2.0, 0.5]))
    q = poses.multiply(turn, ALONG_X)
    p = np.array([0.225, 0.0, 0.3]) + 0.12 * np.array([-0.4, 0.1, 0.2])
    assert np.allclose(final.positions[-1], p, atol=1e-12)
    assert np.allclose(poses.matrix(final.orientations[-1]), poses.matrix(q), atol=1e-12)


@pytest.mark.parametrize("angle", [1e-5, 2.0, 4.0, 7.0, 12.0])
def test_frames_follow_grips_that_turn_by_any_angle_in_a_step(angle: float) -> None:
    rod = Rod(PROPERTIES, 12)
    state = rod.straight((0.0, 0.0, 0.3), (1.0, 0.0, 0.3))
    axis = np.array([0.6, 0.0, 0.8])
    actions = np.zeros((1, 2, 6))
    actions[:, :, 3:] = angle / 0.01 * axis
    found = rod.rollout(RolloutSpec(state, actions, 0.01)).orientations[0, [0, -1]]
    expected = poses.multiply(poses.exponential(angle * axis), state.orientations[[0, -1]])
    np.testing.assert_allclose(found, expected, atol=1e-15)


def test_a_yanked_rope_keeps_its_length() -> None:
    rod = Rod(PROPERTIES, 40)
    actions = np.zeros((20, 2, 6))
    actions[:5, 1, :3] = [-4.0, 2.0, 2.0]
    actions[10:15, 0, :3] = [2.0, -3.0, 3.0]
    rollout = rod.rollout(
        RolloutSpec(rod.straight([-0.225, 0.0, 0.3], [1.0, 0.0, 0.3]), actions, 0.01)
    )
    lengths = [polylines.length(nodes) for nodes in rollout.positions]
    assert rollout.converged.all()
    assert np.max(np.abs(np.array(lengths) / PROPERTIES.length - 1.0)) < 5e-3


def test_energy_never_grows_while_the_grips_stand_still() -> None:
    rod = Rod(replace(PROPERTIES, damping=0.0), 30)
    actions = np.zeros((10, 2, 6))
    actions[:, 1, :3] = [-1.0, 0.5, 0.3]
    moving = rod.rollout(
        RolloutSpec(rod.straight([0.0, 0.0, 0.3], [1.0, 0.0, 0.3]), actions, 0.01)
    ).final
    mass = PROPERTIES.linear_density * rod.edge_length
    energies = []
    for _ in range(60):
        lengths = rod.model.bend_lengths[:, None]
        bending = np.sum(moments(rod, moving) * curvatures(rod, moving) * lengths) / 2.0
        stretch = np.sum(forces(rod, moving) ** 2) * rod.edge_length / 2.0 / 2000.0
        # The nodes at the clamps do not move.
        free = slice(1, -1)
        kinetic = 0.5 * mass * np.sum(moving.velocities[free] ** 2)
        fall = 9.81 * mass * np.sum(moving.positions[free, 2])
        energies.append(bending + stretch + kinetic + fall)
        moving = rod.rollout(RolloutSpec(moving, np.zeros((1, 2, 6)), 0.01)).final
    # The first sample still holds the velocity of the grips.
    assert np.max(np.diff(energies[1:])) < 1e-6 * (energies[1] - energies[-1])


def test_rest_is_an_equilibrium_from_a_bad_start() -> None:
    rod = Rod(PROPERTIES, 40, tolerance=1e-9)
    left, right = grips(0.3)
    found = rod.rest(left, right)
    rng = np.random.default_rng(2)
    crumpled = replace(
        found.state, positions=found.state.positions + 0.02 * rng.normal(size=(40, 3))
    )
    again = rod.rest(left, right, guess=crumpled)
    assert found.converged
    assert found.stable
    assert again.converged
    assert np.allclose(again.state.positions, found.state.positions, atol=1e-6)
    still = rod.rollout(RolloutSpec(found.state, np.zeros((10, 2, 6)), 0.01)).final
    assert np.allclose(still.positions, found.state.positions, atol=1e-6)


def test_rest_between_near_grips_is_reached_by_bringing_the_grips_together() -> None:
    rod = Rod(PROPERTIES, 40)
    wide, near = grips(0.3), grips(0.12)
    actions = np.zeros((40, 2, 6))
    actions[:36, 0, 0], actions[:36, 1, 0] = 0.09 / 36.0, -0.09 / 36.0
    brought = rod.rollout(RolloutSpec(rod.rest(*wide).state, actions, 1.0)).final.positions
    assert polylines.mean_node_distance(brought, rod.rest(*near).state.positions) < 1e-3


def test_rest_lies_on_the_table_and_not_in_it() -> None:
    rod = Rod(PROPERTIES, 40)
    found = rod.rest(*grips(0.3, height=0.05), obstacles=pack([TABLE]))
    clearance = chain_clearance(found.state.positions, PROPERTIES.diameter / 2.0, [TABLE])
    assert found.converged
    assert 0.0 < clearance < 2.0 * PROPERTIES.contact_margin


def test_rest_bends_around_a_sharp_edge_without_cutting_it() -> None:
    box = Obstacle("box", (0.0, 0.0, 0.2), size=(0.05, 0.3, 0.15))
    rod = Rod(replace(PROPERTIES, youngs_modulus=1e4), 20)
    found = rod.rest(*grips(0.36, height=0.26), obstacles=pack([box]))
    assert found.converged
    assert chain_clearance(found.state.positions, PROPERTIES.diameter / 2.0, [box]) > -5e-4


@pytest.mark.parametrize(
    "cone",
    [
        Obstacle("cone", (0.01, 0.0, 0.2), radius=0.06, height=0.14),
        Obstacle("cone", (0.0, 0.0, 0.09), (0.0, 1.0, 0.0, 0.0), radius=0.12, height=0.3),
        Obstacle("cone", (0.0, 0.0, 0.06), (0.5**0.5, 0.5**0.5, 0.0, 0.0), radius=0.3, height=0.8),
    ],
    ids=["over its apex", "over its base", "over its side"],
)
def test_rest_lies_on_a_cone_and_not_in_it(cone: Obstacle) -> None:
    rod = Rod(replace(PROPERTIES, youngs_modulus=1e5), 40)
    found = rod.rest(*grips(0.3, height=0.26), obstacles=pack([cone]))
    clearance = chain_clearance(found.state.positions, PROPERTIES.diameter / 2.0, [cone])
    assert found.converged
    assert -5e-4 < clearance < 2.0 * PROPERTIES.contact_margin


@pytest.mark.parametrize("modulus", [0.3e6, 0.58e6])
def test_a_soft_rod_that_falls_onto_a_thin_bar_lies_over_it(modulus: float) -> None:
    rod = Rod(replace(PROPERTIES, youngs_modulus=modulus), 60)
    turned = (0.5**0.5, 0.5**0.5, 0.0, 0.0)
    bar = Obstacle(
        "capsule", (0.02, 0.0, 0.23), turned, radius=0.015, height=0.16, name="bar", support=True
    )
    left, right = (
        Pose(np.array([-0.15, 0.0, 0.34]), ALONG_X),
        Pose(np.array([0.15, 0.0, 0.36]), ALONG_X),
    )
    nodes = rod.rest(left, right, obstacles=pack([bar])).state.positions
    at_bar = np.argmin(np.abs(nodes[:, 0] - 0.02))
    assert nodes[at_bar, 2] > 0.245


def test_grips_out_of_reach_are_refused() -> None:
    with pytest.raises(ValueError, match="apart"):
        Rod(PROPERTIES, 40).rest(*grips(0.5))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"length": 0.0}, "length"),
        ({"diameter": -0.001}, "diameter"),
        ({"youngs_modulus": -1.0}, "youngs_modulus"),
        ({"linear_density": float("nan")}, "linear_density"),
        ({"damping": -1.0}, "damping"),
        ({"stiffness_profile": (1.0, 0.0)}, "stiffness_profile"),
    ],
)
def test_impossible_properties_are_refused_by_name(
    change: dict[str, float | tuple[float, ...]], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        replace(PROPERTIES, **change)


def test_bad_states_and_actions_are_refused_by_name() -> None:
    rod = Rod(PROPERTIES, 10)
    state = rod.straight([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    with pytest.raises(ValueError, match="actions"):
        rod.rollout(RolloutSpec(state, np.zeros((5, 2, 3)), 0.01))
    with pytest.raises(ValueError, match="must be finite"):
        rod.rollout(RolloutSpec(state, np.full((5, 2, 6), np.nan), 0.01))
    with pytest.raises(ValueError, match=r"state\.positions"):
        rod.rollout(
            RolloutSpec(replace(state, positions=state.positions[:-1]), np.zeros((5, 2, 6)), 0.01)
        )
    crooked = replace(state, orientations=2.0 * state.orientations)
    with pytest.raises(ValueError, match="unit quaternions"):
        rod.rollout(RolloutSpec(crooked, np.zeros((5, 2, 6)), 0.01))
    with pytest.raises(ValueError, match="dt"):
        rod.rollout(RolloutSpec(state, np.zeros((5, 2, 6)), 0.0))
    durations = np.full(5, 0.01)
    with pytest.raises(ValueError, match=r"dt.*\[0\.01"):
        rod.rollout(RolloutSpec(state, np.zeros((5, 2, 6)), durations))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"durations.*4 blocks"):
        rod.settle(state, np.zeros((4, 2, 6)), durations)
    with pytest.raises(ValueError, match=r"durations.*positive"):
        rod.settle(state, np.zeros((5, 2, 6)), -durations)
    with pytest.raises(ValueError, match="no parameter 'colour'"):
        rod.linearize(RolloutSpec(state, np.zeros((5, 2, 6)), 0.01), ("colour",))
