from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import polylines
from lariat.geometry.obstacles import Obstacle, chain_clearance
from lariat.geometry.poses import Pose
from lariat.scenario.cameras import DEFAULT_CAMERA
from lariat.simulation.plants.end_motion import EndMotion
from lariat.simulation.plants.factory import true_properties
from lariat.simulation.world import World
from lariat.trajectory import SECOND
from services.perception.decoding import decode_frame
from services.sim.service import SimService
from shared import topics
from shared.messages import chain, stamp_of
from shared.runtime.service import Inbox, Received
from tests.services.perception.cell import Cell, ScriptedArms, scenario

COLOR = topics.CAMERA_COLOR.at(DEFAULT_CAMERA)
DEPTH = topics.CAMERA_DEPTH.at(DEFAULT_CAMERA)


def glide(time: float) -> tuple[np.ndarray, np.ndarray]:
    """0.1 m along y in about a second, from rest to rest."""
    t = min(max(0.0, time - 0.1), 1.0)
    return (
        np.array([0.0, 0.1 * t * t * (3.0 - 2.0 * t), 0.0]),
        np.array([0.0, 0.6 * t * (1.0 - t), 0.0]),
    )


def test_truth_and_images_come_at_thirty_hertz_with_one_stamp() -> None:
    cell = Cell(scenario())
    cell.run(1.02)
    truth = list(cell.chains(topics.ROPE_TRUTH))
    colors = [stamp_of(m) for m in cell.has_subscribers[COLOR.key]]
    depths = [stamp_of(m) for m in cell.has_subscribers[DEPTH.key]]
    assert colors == depths == truth[: len(colors)]
    assert len(colors) == pytest.approx(30, abs=1)
    calibrations = cell.has_subscribers[topics.CAMERA_CALIBRATION.at(DEFAULT_CAMERA).key]
    assert calibrations[0].K[2] == pytest.approx(319.5)


def test_each_state_of_the_arms_begins_a_step_that_exposes_what_is_due() -> None:
    """No exposure waits for states of the arms that come after its instant."""
    cell = scenario(source="truth")
    service, arms = SimService(cell), ScriptedArms(cell)
    assert service.wakes == (topics.ARM_STATE,)
    delays = []
    for k in range(60):
        now = SECOND + k * SECOND // 125
        (state,) = arms.step(Inbox({}, {}), now)
        arrived = {topics.ARM_STATE.key: [Received(state.message, "robot_gateway-0", k, now)]}
        for publication in service.step(Inbox({}, arrived), now):
            delays.append(publication.message.stamp - SECOND - len(delays) * SECOND // 30)
            assert publication.message.stamp == now
    assert len(delays) == 15
    assert min(delays) >= 0
    assert max(delays) <= SECOND // 125


def test_images_survive_the_wire() -> None:
    cell = Cell(scenario())
    cell.run(0.2)
    images = decode_frame(cell.has_subscribers[COLOR.key][-1], cell.has_subscribers[DEPTH.key][-1])
    assert not isinstance(images, str)
    color, depth = images
    assert color.shape == (480, 640, 3)
    # A rope of 8 mm and 0.45 m, 0.7 m away, at 502 pixels a metre of depth.
    assert np.count_nonzero(color[..., 0] > 128) == pytest.approx(0.45 * 0.008 * 640**2, rel=0.35)
    assert 0.5 < np.median(depth[color[..., 0] > 200]) / 1000.0 < 0.9


def test_the_ends_of_the_rope_are_where_the_arms_are() -> None:
    cell = Cell(scenario(), glide)
    cell.run(1.5)
    states = {m.stamp: m for m in cell.has_subscribers[topics.ARM_STATE.key]}
    compared = 0
    for stamp, truth in cell.chains(topics.ROPE_TRUTH).items():
        if stamp in states:
            nodes = chain(truth.positions)
            np.testing.assert_allclose(nodes[0], states[stamp].arms[0].position, atol=1e-6)
            np.testing.assert_allclose(nodes[-1], states[stamp].arms[1].position, atol=1e-6)
            compared += 1
    assert compared > 30


@pytest.mark.parametrize("model", ["mujoco", "rod"])
def test_a_reset_brings_the_rope_back(model: str) -> None:
    cell = Cell(scenario(source="truth", model=model), glide)
    cell.run(0.1)
    first = chain(cell.has_subscribers[topics.ROPE_TRUTH.key][0].positions)
    cell.run(1.2)
    assert (
        np.max(np.abs(chain(cell.has_subscribers[topics.ROPE_TRUTH.key][-1].positions) - first))
        > 0.05
    )
    cell.arms.reset_count = 2
    cell.arms._motion = lambda _: (np.zeros(3), np.zeros(3))
    cell.run(0.3)
    last = chain(cell.has_subscribers[topics.ROPE_TRUTH.key][-1].positions)
    assert np.max(np.abs(last - first)) < 2e-3


def test_a_gateway_that_starts_anew_leaves_the_rope_where_it_is() -> None:
    def truth(*counts: int) -> np.ndarray:
        cell = Cell(scenario(source="truth"), glide)
        for count in counts:
            cell.arms.reset_count = count
            cell.run(0.3)
        return chain(cell.has_subscribers[topics.ROPE_TRUTH.key][-1].positions)

    np.testing.assert_array_equal(truth(3, 0, 3), truth(3, 3, 3))
    assert np.max(np.abs(truth(3, 3, 4) - truth(3, 3, 3))) > 0.01


@pytest.mark.parametrize("model", ["mujoco", "rod"])
def test_an_obstacle_that_appears_holds_the_rope_up(model: str) -> None:
    world = World(scenario(source="truth", model=model))
    world.hold(SECOND)
    lowest = world.nodes[:, 2].min()
    ball = Obstacle("sphere", (0.0, 0.0, lowest - 0.04), radius=0.03, name="ball")
    world.set_obstacles([ball])
    for k in range(1, 101):
        ends = [
            EndMotion(
                Pose(pose.position - np.array([0.0, 0.0, 5e-4]), pose.orientation),
                np.array([0.0, 0.0, -0.05]),
            )
            for pose in world.grips
        ]
        world.advance(*ends, SECOND + k * SECOND // 100)
    # The grips went down 50 mm, 44 mm further than where the rope met the ball.
    assert -2e-3 < chain_clearance(world.nodes, 0.004, [ball]) < 2e-3
    assert polylines.length(world.nodes) == pytest.approx(0.45, rel=5e-3)


def test_without_arms_the_rope_is_shown_at_its_start() -> None:
    of = scenario()
    world = World(of)
    left, right = of.grips(of.start)
    np.testing.assert_allclose(world.nodes[0], left.position, atol=1e-9)
    np.testing.assert_allclose(world.nodes[-1], right.position, atol=1e-9)
    assert world.instant is None


def test_time_without_arm_states_lets_the_rope_settle() -> None:
    world = World(scenario())
    world.hold(SECOND)
    before = world.nodes
    world.hold(2 * SECOND)
    assert world.instant == 2 * SECOND
    assert np.max(np.abs(world.nodes - before)) < 1e-3


def test_both_plants_agree_on_a_hanging_rope() -> None:
    shapes = [World(scenario(model=model)).nodes for model in ("mujoco", "rod")]
    assert np.max(np.linalg.norm(shapes[0] - shapes[1], axis=1)) < 1.5e-3


def test_the_truth_may_differ_from_what_is_believed() -> None:
    of = scenario(
        "[plant.rope]\nyoungs_modulus = 4.0e6\nstiffness_profile = [1.0, 2.0]\n"
        "internal_damping = 0.02\n"
    )
    assert true_properties(of).youngs_modulus == 4.0e6
    assert true_properties(of).stiffness_profile == (1.0, 2.0)
    assert true_properties(of).internal_damping == 0.02
    assert of.rope.youngs_modulus == 1.0e6
