from __future__ import annotations

import pytest

from benchmarks.ways.scenes import CLEARANCE, WayScene, sample_scene


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
    for shape, side in ((scene.scenario.start, -1.0), (scene.scenario.goal, 1.0)):
        assert shape.line is not None
        assert all(side * point[1] > 0.1 for point in shape.line)
    assert (scene.goal_nodes[:, 1] > 0.1).all()


def test_the_same_number_gives_the_same_scene(scene: WayScene) -> None:
    assert sample_scene("posts", 0, 0, 3.0).scenario.obstacles == scene.scenario.obstacles
