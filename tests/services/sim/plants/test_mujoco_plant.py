from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import polylines, poses
from lariat.geometry.obstacles import TABLE, Obstacle, chain_clearance
from lariat.geometry.poses import Pose
from services.sim.plants.end_motion import EndMotion
from services.sim.plants.mujoco_model import MujocoRope
from services.sim.plants.mujoco_plant import MujocoPlant

ALONG_X = np.array([0.5, 0.5, 0.5, 0.5])
ROPE = MujocoRope(0.45, 0.008, 30, 0.044, 1.0e6, damping=2.0)
LEFT = Pose(np.array([-0.18, 0.0, 0.3]), ALONG_X)
RIGHT = Pose(np.array([0.18, 0.0, 0.3]), ALONG_X)
TILT = tuple(poses.exponential(np.array([0.0, 0.3, 0.5])))
BODIES = {
    "cylinder": Obstacle("cylinder", (0.0, 0.0, 0.1), radius=0.04, height=0.16),
    "box": Obstacle("box", (0.0, 0.0, 0.1), TILT, size=(0.1, 0.08, 0.16)),
    "sphere": Obstacle("sphere", (0.0, 0.0, 0.12), radius=0.06),
    "capsule": Obstacle("capsule", (0.0, 0.0, 0.1), TILT, radius=0.05, height=0.06),
    "half_space": Obstacle("half_space", (0.0, 0.0, 0.18), normal=(0.05, 0.1, 1.0)),
}


def lower(plant: MujocoPlant, depth: float) -> None:
    """Move both grips straight down within a second, then hold them."""

    def ends(z: float, speed: float) -> list[EndMotion]:
        down, velocity = np.array([0.0, 0.0, z]), np.array([0.0, 0.0, speed])
        return [EndMotion(Pose(p.position + down, ALONG_X), velocity) for p in (LEFT, RIGHT)]

    for z in np.linspace(0.0, -depth, 101)[1:]:
        plant.step(*ends(z, -depth), 0.01)
    plant.step(*ends(-depth, 0.0), 0.5)


def test_the_first_and_last_edges_are_clamped_along_their_grips() -> None:
    plant = MujocoPlant(ROPE, [TABLE])
    plant.reset(LEFT, RIGHT)
    edge = 0.45 / 29
    np.testing.assert_allclose(plant.nodes[0], LEFT.position, atol=1e-9)
    np.testing.assert_allclose(plant.nodes[1], LEFT.position + np.array([edge, 0, 0]), atol=1e-9)
    np.testing.assert_allclose(plant.nodes[-2], RIGHT.position - np.array([edge, 0, 0]), atol=1e-9)


def test_the_rope_keeps_its_length_while_it_is_swung() -> None:
    plant = MujocoPlant(ROPE, [TABLE])
    plant.reset(LEFT, RIGHT)
    for k in range(1, 101):
        shift = np.array([0.0, 0.15 * np.sin(2.0 * np.pi * k / 100), 0.0])
        speed = np.array([0.0, 0.15 * 2.0 * np.pi * np.cos(2.0 * np.pi * k / 100), 0.0])
        end = EndMotion(Pose(RIGHT.position + shift, ALONG_X), speed)
        plant.step(EndMotion(LEFT), end, 0.01)
        assert polylines.length(plant.nodes) == pytest.approx(0.45, rel=2e-3)


@pytest.mark.parametrize("kind", BODIES)
def test_the_rope_rests_on_every_kind_of_obstacle(kind: str) -> None:
    plant = MujocoPlant(ROPE, [BODIES[kind]])
    plant.reset(LEFT, RIGHT)
    lower(plant, 0.1)
    clearance = chain_clearance(plant.nodes, 0.004, [BODIES[kind]])
    # Held up by it, neither sunk in nor hovering.
    assert -0.0015 < clearance < 0.001


def test_twisting_an_end_moves_the_rope_out_of_its_plane() -> None:
    plant = MujocoPlant(ROPE, [TABLE])
    plant.reset(LEFT, RIGHT)
    assert np.max(np.abs(plant.nodes[:, 1])) < 1e-6
    for angle in np.linspace(0.0, 6.0 * np.pi, 301)[1:]:
        turn = poses.exponential(np.array([0.0, 0.0, angle]))
        end = Pose(RIGHT.position, poses.multiply(ALONG_X, turn))
        plant.step(EndMotion(LEFT), EndMotion(end), 0.01)
    assert np.max(np.abs(plant.nodes[:, 1])) > 0.01


def test_a_profile_bends_where_it_is_soft() -> None:
    even = MujocoPlant(ROPE, [])
    soft_left = MujocoPlant(
        MujocoRope(0.45, 0.008, 30, 0.044, 1.0e6, damping=2.0, stiffness_profile=(0.5, 0.5, 2, 2)),
        [],
    )
    for plant in (even, soft_left):
        plant.reset(LEFT, RIGHT)
    lowest = [p.nodes[np.argmin(p.nodes[:, 2]), 0] for p in (even, soft_left)]
    assert abs(lowest[0]) < 0.01
    mirrored = even.nodes[::-1] * [-1.0, 1.0, 1.0]
    assert np.max(np.abs(even.nodes - mirrored)) < 1e-4
    assert np.max(np.linalg.norm(soft_left.nodes - even.nodes, axis=1)) > 0.003


def test_new_obstacles_leave_the_rope_where_it_is() -> None:
    plant = MujocoPlant(ROPE, [TABLE])
    plant.reset(LEFT, RIGHT)
    before = plant.nodes
    plant.set_obstacles([TABLE, BODIES["sphere"]])
    np.testing.assert_array_equal(plant.nodes, before)


def test_the_same_motion_gives_the_same_bits() -> None:
    runs = []
    for _ in range(2):
        plant = MujocoPlant(ROPE, [BODIES["cylinder"]])
        plant.reset(LEFT, RIGHT)
        lower(plant, 0.08)
        runs.append(plant.nodes.tobytes())
    assert runs[0] == runs[1]


def test_grips_out_of_reach_are_refused() -> None:
    far = Pose(RIGHT.position + np.array([0.3, 0.0, 0.0]), ALONG_X)
    with pytest.raises(ValueError, match="closer together"):
        MujocoPlant(ROPE).reset(LEFT, far)
