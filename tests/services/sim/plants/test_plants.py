from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import polylines, poses
from lariat.geometry.obstacles import TABLE, Obstacle, chain_clearance
from lariat.geometry.poses import Pose
from lariat.rod import RodProperties
from services.sim.plants.end_motion import EndMotion, interpolate
from services.sim.plants.mujoco_model import MujocoRope, rest_shape
from services.sim.plants.mujoco_plant import MujocoPlant
from services.sim.plants.rod_plant import RodPlant
from services.sim.plants.slack_curve import slack_curve

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


def lowered(plant: MujocoPlant, depth: float) -> None:
    """Both grips go straight down in one second, then stand."""

    def ends(z: float, speed: float) -> list[EndMotion]:
        down, velocity = np.array([0.0, 0.0, z]), np.array([0.0, 0.0, speed])
        return [EndMotion(Pose(p.position + down, ALONG_X), velocity) for p in (LEFT, RIGHT)]

    for z in np.linspace(0.0, -depth, 101)[1:]:
        plant.step(*ends(z, -depth), 0.01)
    plant.step(*ends(-depth, 0.0), 0.5)


def test_a_grip_meets_both_poses_and_both_twists() -> None:
    turned = poses.multiply(poses.exponential(np.array([0.0, 0.2, 0.1])), ALONG_X)
    start = EndMotion(LEFT, np.array([0.1, 0.0, 0.0]), np.array([0.0, 0.0, 0.3]))
    end = EndMotion(
        Pose(LEFT.position + 0.02, turned), np.array([0.0, -0.1, 0.2]), np.array([0.1, 0.2, 0.3])
    )
    tiny = 1e-6
    times = np.array([0.0, tiny, 0.1, 0.1 + tiny])
    positions, orientations = interpolate(start, end, 0.1, times)
    turns = poses.multiply(orientations[1::2], poses.conjugate(orientations[::2]))
    rates = poses.logarithm(turns) / tiny
    for k, motion in enumerate((start, end)):
        here = 2 * k
        np.testing.assert_allclose(positions[here], motion.pose.position, atol=1e-12)
        np.testing.assert_allclose(
            np.abs(orientations[here] @ motion.pose.orientation), 1.0, atol=1e-12
        )
        rate = (positions[here + 1] - positions[here]) / tiny
        np.testing.assert_allclose(rate, motion.linear, atol=1e-4)
    np.testing.assert_allclose(rates[0], start.angular, atol=1e-4)


def test_a_slack_curve_has_its_length_between_its_grips() -> None:
    curve = slack_curve(LEFT, RIGHT, 0.45, 40)
    np.testing.assert_allclose(curve[[0, -1]], [LEFT.position, RIGHT.position], atol=1e-12)
    assert polylines.length(curve) == pytest.approx(0.45, rel=0.01)


def test_an_unloaded_rope_with_rest_curvature_is_a_circle() -> None:
    curvature = 8.0
    nodes, _ = rest_shape(MujocoRope(0.45, 0.008, 91, 0.044, 1e6, rest_curvature=(curvature, 0, 0)))
    # The tangent stays in the plane of z and y; a circle's chord is 2 sin(s k / 2) / k.
    chord = np.linalg.norm(nodes[-1] - nodes[0])
    assert np.ptp(nodes[:, 0]) < 1e-12
    assert chord == pytest.approx(2.0 / curvature * np.sin(0.45 * curvature / 2.0), rel=1e-3)


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
    lowered(plant, 0.1)
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
        lowered(plant, 0.08)
        runs.append(plant.nodes.tobytes())
    assert runs[0] == runs[1]


def test_grips_out_of_reach_are_refused() -> None:
    far = Pose(RIGHT.position + np.array([0.3, 0.0, 0.0]), ALONG_X)
    with pytest.raises(ValueError, match="closer together"):
        MujocoPlant(ROPE).reset(LEFT, far)


def curled(self_contact: bool) -> float:
    """How near strands come when an end of a slack rope is turned six times, in diameters."""
    plant = RodPlant(RodProperties(0.45, 0.008, 0.044, 1e6, damping=5.0), 40, (), self_contact)
    right = Pose(np.array([0.07, 0.0, 0.3]), ALONG_X)
    plant.reset(LEFT, right)
    closest = np.inf
    for angle in np.linspace(0.0, 12.0 * np.pi, 241)[1:]:
        turn = poses.exponential(np.array([angle, 0.0, 0.0]))
        turned = Pose(right.position, poses.multiply(turn, ALONG_X))
        plant.step(EndMotion(LEFT), EndMotion(turned, angular=np.array([5.0 * np.pi, 0, 0])), 0.01)
        fine = polylines.resampled(plant.nodes, 160)
        apart = np.linalg.norm(fine[:, None] - fine[None], axis=2)
        along = np.abs(np.arange(160)[:, None] - np.arange(160)[None]) * 0.45 / 159
        closest = min(closest, np.min(apart[along > 4.0 * 0.008]) / 0.008)
    return closest


def test_strands_of_a_rope_that_curls_up_touch_where_they_are_asked_to() -> None:
    assert curled(False) < 0.7
    assert curled(True) > 0.95
