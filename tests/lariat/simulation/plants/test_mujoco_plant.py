# pyright: reportAttributeAccessIssue=false
# MuJoCo has no stubs.
from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from lariat.configuration import ConfigurationError
from lariat.geometry import polylines, poses
from lariat.geometry.obstacles import TABLE, Obstacle, chain_clearance
from lariat.geometry.poses import Pose
from lariat.rod import RodProperties
from lariat.simulation.plants.end_motion import EndMotion
from lariat.simulation.plants.flex_rope import FlexRope
from lariat.simulation.plants.linked_rope import LinkedRope
from lariat.simulation.plants.mujoco_plant import MujocoPlant
from lariat.simulation.plants.mujoco_rope import MujocoRope
from lariat.simulation.plants.rod_plant import RodPlant

ALONG_X = np.array([0.5, 0.5, 0.5, 0.5])
ROPE = MujocoRope(0.45, 0.008, 30, 0.044, 1.0e6, damping=2.0)
LEFT = Pose(np.array([-0.18, 0.0, 0.3]), ALONG_X)
RIGHT = Pose(np.array([0.18, 0.0, 0.3]), ALONG_X)
TILT = tuple(poses.exponential(np.array([0.0, 0.3, 0.5])))
Kind = type[FlexRope] | type[LinkedRope]
both = pytest.mark.parametrize("kind", [FlexRope, LinkedRope])
BODIES = {
    "cylinder": Obstacle("cylinder", (0.0, 0.0, 0.1), radius=0.04, height=0.16),
    "box": Obstacle("box", (0.0, 0.0, 0.1), TILT, size=(0.1, 0.08, 0.16)),
    "sphere": Obstacle("sphere", (0.0, 0.0, 0.12), radius=0.06),
    "capsule": Obstacle("capsule", (0.0, 0.0, 0.1), TILT, radius=0.05, height=0.06),
    "cone": Obstacle("cone", (0.0, 0.0, 0.1), (0.0, 1.0, 0.0, 0.0), radius=0.06, height=0.16),
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


@both
@pytest.mark.parametrize(("gap", "rise"), [(0.3, 0.1), (0.42, -0.1)])
def test_tension_is_that_of_a_rod_between_the_same_grips(
    kind: Kind, gap: float, rise: float
) -> None:
    left = Pose(np.array([-0.5 * gap, 0.0, 0.3]), ALONG_X)
    right = Pose(np.array([0.5 * gap, 0.0, 0.3 + rise]), ALONG_X)
    rope = replace(ROPE, node_count=100)
    plant = MujocoPlant(kind(rope))
    plant.reset(left, right)
    rod = RodPlant(RodProperties(rope.length, rope.diameter, rope.linear_density, 1.0e6), 100)
    rod.reset(left, right)
    assert plant.tension == pytest.approx(rod.tension, rel=0.02)
    # Pulled to one side at 0.1 m/s.
    for k in range(1, 101):
        shift, velocity = np.array([0.0, 0.001 * k, 0.0]), np.array([0.0, 0.1, 0.0])
        ends = [EndMotion(Pose(p.position + shift, ALONG_X), velocity) for p in (left, right)]
        plant.step(*ends, 0.01)
        rod.step(*ends, 0.01)
    assert plant.tension == pytest.approx(rod.tension, rel=0.05)


@both
def test_the_ends_are_at_their_grips_even_while_these_move(kind: Kind) -> None:
    plant = MujocoPlant(kind(ROPE), [TABLE])
    plant.reset(LEFT, RIGHT)
    np.testing.assert_allclose(plant.nodes[[0, -1]], [LEFT.position, RIGHT.position], atol=1e-6)
    for k in range(1, 51):
        there = Pose(RIGHT.position - np.array([0.004 * k, 0.0, 0.0]), ALONG_X)
        plant.step(EndMotion(LEFT), EndMotion(there, np.array([-0.4, 0.0, 0.0])), 0.01)
        np.testing.assert_allclose(plant.nodes[-1], there.position, atol=2e-4)


def test_a_rope_is_not_behind_its_grips_where_steps_end_at_the_frames() -> None:
    """Else the middle lags by up to a step of the engine: 1.2 mm at 0.6 m/s."""
    frame, middles = 0.0085, []
    for timestep in (0.002, frame / 9, frame / 27):
        plant = MujocoPlant(LinkedRope(ROPE), timestep=timestep)
        plant.reset(LEFT, RIGHT)
        for k in range(1, 33):
            phase = 12.0 * frame * k
            at = np.array([0.0, 0.0, 0.05 * (1.0 - np.cos(phase))])
            speed = np.array([0.0, 0.0, 0.6 * np.sin(phase)])
            ends = [EndMotion(Pose(p.position + at, ALONG_X), speed) for p in (LEFT, RIGHT)]
            plant.step(*ends, frame)
            middles.append(plant.nodes[15, 2])
    behind, near, reference = np.reshape(middles, (3, -1))
    assert np.abs(behind - reference).max() > 1e-3
    assert np.abs(near - reference).max() < 5e-4


@both
def test_the_rope_keeps_its_length_while_it_is_swung(kind: Kind) -> None:
    plant = MujocoPlant(kind(ROPE), [TABLE])
    plant.reset(LEFT, RIGHT)
    for k in range(1, 101):
        shift = np.array([0.0, 0.15 * np.sin(2.0 * np.pi * k / 100), 0.0])
        speed = np.array([0.0, 0.15 * 2.0 * np.pi * np.cos(2.0 * np.pi * k / 100), 0.0])
        end = EndMotion(Pose(RIGHT.position + shift, ALONG_X), speed)
        plant.step(EndMotion(LEFT), end, 0.01)
        assert polylines.length(plant.nodes) == pytest.approx(0.45, rel=2e-3)


@pytest.mark.parametrize(
    ("kind", "shape"), [*((FlexRope, shape) for shape in BODIES), (LinkedRope, "capsule")]
)
def test_the_rope_rests_on_every_kind_of_obstacle(kind: Kind, shape: str) -> None:
    plant = MujocoPlant(kind(ROPE), [BODIES[shape]])
    plant.reset(LEFT, RIGHT)
    lower(plant, 0.1)
    clearance = chain_clearance(plant.nodes, 0.004, [BODIES[shape]])
    # Held up by it, neither sunk in nor hovering.
    assert -0.0015 < clearance < 0.001


@both
def test_twisting_an_end_moves_the_rope_out_of_its_plane(kind: Kind) -> None:
    plant = MujocoPlant(kind(ROPE), [TABLE])
    plant.reset(LEFT, RIGHT)
    assert np.max(np.abs(plant.nodes[:, 1])) < 1e-6
    for angle in np.linspace(0.0, 6.0 * np.pi, 301)[1:]:
        turn = poses.exponential(np.array([0.0, 0.0, angle]))
        end = Pose(RIGHT.position, poses.multiply(ALONG_X, turn))
        plant.step(EndMotion(LEFT), EndMotion(end), 0.01)
    assert np.max(np.abs(plant.nodes[:, 1])) > 0.01


@both
def test_a_profile_bends_where_it_is_soft(kind: Kind) -> None:
    even = MujocoPlant(kind(ROPE))
    soft_left = MujocoPlant(kind(replace(ROPE, stiffness_profile=(0.5, 0.5, 2.0, 2.0))))
    for plant in (even, soft_left):
        plant.reset(LEFT, RIGHT)
    lowest = [p.nodes[np.argmin(p.nodes[:, 2]), 0] for p in (even, soft_left)]
    assert abs(lowest[0]) < 0.01
    mirrored = even.nodes[::-1] * [-1.0, 1.0, 1.0]
    assert np.max(np.abs(even.nodes - mirrored)) < 1e-4
    assert np.max(np.linalg.norm(soft_left.nodes - even.nodes, axis=1)) > 0.003


@both
def test_a_repeated_reset_comes_to_the_same_rest_without_settling_again(
    kind: Kind, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant = MujocoPlant(kind(ROPE), [TABLE])
    plant.reset(LEFT, RIGHT)
    rest = plant.nodes
    lower(plant, 0.05)
    moved = plant.nodes
    steps, step = [], mujoco.mj_step
    monkeypatch.setattr(mujoco, "mj_step", lambda *args: steps.append(step(*args)))
    plant.reset(LEFT, RIGHT)
    assert not steps
    np.testing.assert_array_equal(plant.nodes, rest)
    lower(plant, 0.05)
    np.testing.assert_array_equal(plant.nodes, moved)


def test_a_reset_settles_anew_where_grips_or_obstacles_differ() -> None:
    plant = MujocoPlant(FlexRope(ROPE), [TABLE])
    plant.reset(LEFT, RIGHT)
    lower_end = Pose(RIGHT.position - np.array([0.0, 0.0, 0.05]), ALONG_X)
    for grips, bodies in (
        ((LEFT, lower_end), [TABLE]),
        ((LEFT, RIGHT), [TABLE, BODIES["sphere"].moved((0.0, 0.0, 0.18))]),
        ((LEFT, RIGHT), [TABLE, BODIES["sphere"].moved((0.0, 0.0, 0.2))]),
    ):
        plant.set_obstacles(bodies)
        plant.reset(*grips)
        fresh = MujocoPlant(FlexRope(ROPE), bodies)
        fresh.reset(*grips)
        assert np.max(np.abs(plant.nodes - fresh.nodes)) < 1e-4


@both
def test_new_obstacles_leave_the_rope_where_it_is(kind: Kind) -> None:
    plant = MujocoPlant(kind(ROPE), [TABLE])
    plant.reset(LEFT, RIGHT)
    before = plant.nodes
    plant.set_obstacles([TABLE, BODIES["sphere"]])
    np.testing.assert_array_equal(plant.nodes, before)


@both
def test_an_obstacle_that_moves_against_the_rope_pushes_it(kind: Kind) -> None:
    box, sphere = BODIES["box"], BODIES["sphere"].moved((0.5, 0.5, 0.1))
    plant = MujocoPlant(kind(ROPE), [TABLE, box.moved((0.0, 0.5, 0.1)), sphere])
    plant.reset(LEFT, RIGHT)
    for y in np.linspace(0.2, 0.03, 35):
        box = box.moved((0.0, y, float(plant.nodes[:, 2].min())))
        plant.set_obstacles([TABLE, box, sphere])
        plant.step(EndMotion(LEFT), EndMotion(RIGHT), 0.02)
    assert plant.nodes[:, 1].min() < -0.01
    assert chain_clearance(plant.nodes, ROPE.diameter / 2.0, [box]) > -0.002


@both
def test_the_same_motion_gives_the_same_bits(kind: Kind) -> None:
    runs = []
    for _ in range(2):
        plant = MujocoPlant(kind(ROPE), [BODIES["cylinder"]])
        plant.reset(LEFT, RIGHT)
        lower(plant, 0.08)
        runs.append(plant.nodes.tobytes())
    assert runs[0] == runs[1]


def test_grips_out_of_reach_are_refused() -> None:
    far = Pose(RIGHT.position + np.array([0.3, 0.0, 0.0]), ALONG_X)
    with pytest.raises(ValueError, match="closer together"):
        MujocoPlant(FlexRope(ROPE)).reset(LEFT, far)


def test_links_that_twist_and_bend_out_of_a_plane_agree_with_the_elastic_rod() -> None:
    yaw = poses.exponential(np.array([0.0, 0.0, 0.6]))
    spin = poses.exponential(np.array([0.0, 0.0, 2.5]))
    left = Pose(np.array([-0.12, 0.0, 0.3]), poses.multiply(yaw, ALONG_X))
    right = Pose(np.array([0.12, 0.0, 0.3]), poses.multiply(ALONG_X, spin))
    shapes = []
    for kind in (FlexRope, LinkedRope):
        plant = MujocoPlant(kind(replace(ROPE, node_count=80)))
        plant.reset(left, right)
        shapes.append(plant.nodes)
    assert np.mean(np.linalg.norm(shapes[0] - shapes[1], axis=1)) < 1.5e-4


def test_a_long_rope_of_links_comes_to_rest_from_its_guess() -> None:
    # Without creeping out of its guess this rope makes the engine diverge.
    rope = MujocoRope(1.98, 0.012, 120, 0.1, 3.22e6, damping=1.0)
    left = Pose(np.array([-0.8489, -0.4520, 0.9520]), ALONG_X)
    right = Pose(np.array([0.8506, -0.4483, 0.9500]), ALONG_X)
    plant = MujocoPlant(LinkedRope(rope), [TABLE])
    plant.reset(left, right)
    np.testing.assert_allclose(plant.nodes[[0, -1]], [left.position, right.position], atol=1e-6)
    hanging = plant.nodes[:, 2].min()
    assert 0.4 < hanging < 0.6
    plant.step(EndMotion(left), EndMotion(right), 0.2)
    assert plant.nodes[:, 2].min() == pytest.approx(hanging, abs=2e-4)


def test_a_simulation_that_diverges_is_refused_and_writes_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.chdir(tmp_path)
    plant = MujocoPlant(FlexRope(ROPE))
    plant.reset(LEFT, RIGHT)
    far = Pose(np.array([1e6, 0.0, 0.3]), ALONG_X)
    with pytest.raises(ConfigurationError, match="diverges with 30 nodes"):
        plant.step(EndMotion(LEFT), EndMotion(far), 0.01)
    assert "Nan, Inf" in caplog.text
    assert not list(tmp_path.iterdir())
