"""Drawing of the cell in viewers' types."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lariat.geometry.obstacles import Obstacle, signed_distance
from lariat.scenario.cameras import DEFAULT_CAMERA
from services.recorder.view import colors
from services.recorder.view.cell_view import CURVE_PERIOD, REFRESH_PERIOD
from services.recorder.view.surfaces import surface_points
from shared import topics
from shared.cell_description import WORLD_FRAME
from shared.messages import NodeChain
from tests.services.recorder.view import cell

POINT = np.dtype([("position", "<f4", 3), ("color", "u1", 4)])


@pytest.fixture
def scenario(tmp_path: Path):
    return cell.scenario(tmp_path)


def drawn(view, now: int = cell.NOW) -> dict:
    return {topic.key: message for topic, message in view.draw(now)}


def points(cloud) -> np.ndarray:
    return np.frombuffer(cloud.data, POINT)


def test_every_curve_is_a_line_and_a_point_cloud(scenario):
    said = drawn(cell.view(scenario))
    entities = {entity.id: entity for entity in said["view/scene"].entities}
    for name, count in {"rope": 4, "truth": 4, "goal": 4, "prediction": 4, "path": 18}.items():
        assert len(points(said[f"view/points/{name}"])) == count
        assert sum(len(line.points) for line in entities[name].lines) == count
    (rope,) = entities["rope"].lines
    first = rope.points[0]
    assert (first.x, first.y, first.z) == (-0.2, 0.0, 0.3)
    assert rope.thickness == pytest.approx(0.008)
    # The last predicted chain, half a decimetre from the first.
    (prediction,) = entities["prediction"].lines
    assert prediction.points[0].y == pytest.approx(0.05)


def test_the_rope_is_coloured_by_its_standard_deviation(scenario):
    said = drawn(cell.view(scenario))
    shades = points(said["view/points/rope"])["color"] / 255.0
    halfway = (np.array(colors.ROPE) + np.array(colors.UNCERTAIN_ROPE)) / 2.0
    expected = [colors.ROPE, halfway, colors.UNCERTAIN_ROPE, colors.UNCERTAIN_ROPE]
    np.testing.assert_allclose(shades, expected, atol=0.003)
    (line,) = next(e for e in said["view/scene"].entities if e.id == "rope").lines
    np.testing.assert_allclose([[c.r, c.g, c.b, c.a] for c in line.colors], expected)


def test_the_flange_of_the_drawn_arm_holds_the_grip(scenario):
    transforms = drawn(cell.view(scenario))["view/transforms"].transforms
    chain = cell.pose(transforms, "right/base_link")
    for k in range(1, 7):
        chain = chain @ cell.pose(transforms, f"right/link_{k}")
    grip = cell.pose(transforms, "right/grip")
    tool = np.array(scenario.ends.right.tool_position)
    np.testing.assert_allclose(chain.apply(tool), grip.position, atol=1e-4)
    (joints,) = [m for t, m in cell.view(scenario).draw(cell.NOW) if t == topics.VIEW_JOINTS]
    assert [j.name for j in joints.joints] == [f"right/joint_{k}" for k in range(1, 7)]


def test_arms_and_grippers_are_bodies_of_their_frames(scenario):
    entities = {e.id: e for e in drawn(cell.view(scenario))["view/scene"].entities}
    assert entities["right/link_2"].frame_id == "right/link_2"
    assert entities["right/link_2"].frame_locked
    height = scenario.limits.gripper_height
    # They point away from the rope.
    (left,), (right,) = entities["left/grip"].cylinders, entities["right/grip"].cylinders
    assert (left.pose.position.z, right.pose.position.z) == (-height / 2, height / 2)
    assert entities["rope"].frame_id == WORLD_FRAME
    # The table, and the capsule as a cylinder between two caps.
    assert len(entities["obstacles"].cubes) == len(entities["obstacles"].cylinders) == 1
    caps = [s.pose.position.z for s in entities["obstacles"].spheres]
    assert caps == pytest.approx([0.15, 0.25])


def test_depth_lies_on_the_table_in_the_world(scenario):
    said = drawn(cell.view(scenario))
    cloud = said[f"view/points/{DEFAULT_CAMERA}"]
    camera = cell.pose(said["view/transforms"].transforms, cloud.frame_id)
    found = camera.apply(points(cloud)["position"].astype(float))
    # The pixel without depth is left out.
    assert len(found) == cell.WIDTH * cell.HEIGHT - 1
    np.testing.assert_allclose(found[:, 2], 0.0, atol=1e-6)
    widest = cell.WIDTH / 2 / cell.FOCAL
    assert np.abs(found[:, :2]).max() == pytest.approx(widest)


def test_only_what_has_changed_is_drawn_and_all_of_it_once_a_second(scenario):
    view = cell.view(scenario)
    first = drawn(view)
    assert set(drawn(view, cell.NOW + 1)) == set()
    chain = NodeChain(positions=[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]).SerializeToString()
    view.take("rope/nodes", chain)
    # Not yet: the curves have just been drawn.
    assert set(drawn(view, cell.NOW + 2)) == set()
    assert set(drawn(view, cell.NOW + CURVE_PERIOD)) == {"view/points/rope", "view/scene"}
    assert set(drawn(view, cell.NOW + REFRESH_PERIOD)) == set(first)


def test_a_lost_rope_is_no_longer_drawn(scenario):
    view = cell.view(scenario)
    drawn(view)
    view.take("rope/nodes", NodeChain(lost="hidden").SerializeToString())
    said = drawn(view, cell.NOW + CURVE_PERIOD)
    assert len(points(said["view/points/rope"])) == 0
    assert [len(e.lines) for e in said["view/scene"].entities] == [0]


@pytest.mark.parametrize(
    "obstacle",
    [
        Obstacle("box", (0.1, 0.2, 0.3), (0.8, 0.6, 0.0, 0.0), size=(0.1, 0.2, 0.3)),
        Obstacle("sphere", (0.1, 0.2, 0.3), radius=0.05),
        Obstacle("cylinder", (0.1, 0.2, 0.3), (0.8, 0.6, 0.0, 0.0), radius=0.03, height=0.2),
        Obstacle("capsule", (0.1, 0.2, 0.3), (0.8, 0.6, 0.0, 0.0), radius=0.03, height=0.2),
        Obstacle("half_space", (0.0, 0.0, 0.1), normal=(0.0, 0.6, 0.8)),
        Obstacle("cone", (0.1, 0.2, 0.3), (0.8, 0.6, 0.0, 0.0), radius=0.05, height=0.2),
    ],
    ids=lambda obstacle: obstacle.shape,
)
def test_points_of_an_obstacle_lie_on_its_surface(obstacle):
    found = surface_points(obstacle)
    assert len(found) > 100
    np.testing.assert_allclose(signed_distance(found, obstacle), 0.0, atol=1e-9)
