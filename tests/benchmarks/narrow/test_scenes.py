from __future__ import annotations

import numpy as np
import pytest

from benchmarks.narrow.scenes import CLEARANCE, WayScene, sample_scene


@pytest.fixture(scope="module")
def scene() -> WayScene:
    return sample_scene("posts", 0, 0, 3.0)


def test_the_plant_has_verified_the_hidden_way(scene: WayScene) -> None:
    assert scene.hidden_clearance >= CLEARANCE


def test_the_opening_is_as_wide_as_stated(scene: WayScene) -> None:
    left, right = sorted(
        (o for o in scene.scenario.obstacles if o.shape == "cylinder"), key=lambda o: o.position[0]
    )
    gap = right.position[0] - left.position[0] - 2.0 * (left.radius or 0.0)
    assert gap == pytest.approx(3.0 * scene.scenario.rope.diameter)


def test_start_and_goal_lie_on_both_sides(scene: WayScene) -> None:
    assert scene.scenario.start.line is not None
    assert all(point[1] < -0.1 for point in scene.scenario.start.line)
    assert (scene.goal_nodes[:, 1] > 0.1).all()


def test_the_goal_is_the_shape_of_the_true_rope(scene: WayScene) -> None:
    nodes = scene.scenario.nodes(scene.scenario.goal)
    assert nodes is not None
    assert len(nodes) == scene.scenario.rope.node_count
    np.testing.assert_allclose(nodes[[0, -1]], scene.goal_nodes[[0, -1]], atol=1e-9)


def test_the_same_number_gives_the_same_scene_whatever_is_believed(scene: WayScene) -> None:
    again = sample_scene("posts", 0, 0, 3.0, 1.5, "mujoco")
    assert again.scenario.obstacles == scene.scenario.obstacles
    np.testing.assert_array_equal(again.goal_nodes, scene.goal_nodes)
    believed, true = again.scenario.rope, again.scenario.plant_rope
    assert true.youngs_modulus == pytest.approx(1.5 * believed.youngs_modulus)
