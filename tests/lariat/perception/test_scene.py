"""Obstacle scene: requests change what requests have added; the scenario's bodies stay."""

from __future__ import annotations

import pytest

from lariat.geometry.obstacles import TABLE, Obstacle
from lariat.perception.scene import SceneChangeRefused, SceneOwner
from lariat.scenario import Event

POST = Obstacle("cylinder", (0.0, 0.0, 0.1), radius=0.02, height=0.2, name="post")
BALL = Obstacle("sphere", (0.3, 0.0, 0.1), radius=0.05, name="ball")


@pytest.fixture
def scene() -> SceneOwner:
    return SceneOwner([TABLE, POST], [], radius=0.004)


def test_added_obstacle_can_be_removed(scene: SceneOwner) -> None:
    scene.add(BALL)
    scene.remove("ball")
    assert scene.obstacles == (TABLE, POST)


@pytest.mark.parametrize("name", ["table", "post"])
def test_body_of_the_scenario_is_not_removed(scene: SceneOwner, name: str) -> None:
    with pytest.raises(SceneChangeRefused, match="belongs to the scenario"):
        scene.remove(name)
    assert scene.obstacles == (TABLE, POST)


def test_reset_keeps_what_people_changed_and_restore_does_not(scene: SceneOwner) -> None:
    scene.add(BALL)
    scene.move("post", (0.1, 0.0, 0.1))
    scene.reset()
    assert [o.name for o in scene.obstacles] == ["table", "post", "ball"]
    assert scene.obstacles[1].position == (0.1, 0.0, 0.1)
    scene.restore()
    assert scene.obstacles == (TABLE, POST)


def test_reset_undoes_what_events_changed() -> None:
    events = [Event(0.5, move_obstacle="post", position=(0.2, 0.0, 0.1))]
    scene = SceneOwner([TABLE, POST], events, radius=0.004)
    scene.add(BALL)
    assert scene.follow_run(1, 1_000_000_000) == []
    assert scene.obstacles[1].position == (0.2, 0.0, 0.1)
    scene.reset()
    assert scene.obstacles == (TABLE, POST, BALL)


def test_added_obstacle_is_resized_at_its_place_and_one_of_the_scenario_is_not(
    scene: SceneOwner,
) -> None:
    scene.add(BALL)
    scene.resize(Obstacle("sphere", (9.0, 9.0, 9.0), radius=0.08, name="ball"))
    assert scene.obstacles[2] == Obstacle("sphere", (0.3, 0.0, 0.1), radius=0.08, name="ball")
    scene.reset()
    assert scene.obstacles[2].radius == 0.08
    with pytest.raises(SceneChangeRefused, match="'post' belongs to the scenario"):
        scene.resize(Obstacle("cylinder", (0.0, 0.0, 0.1), radius=0.01, height=0.2, name="post"))
    with pytest.raises(SceneChangeRefused):
        scene.resize(Obstacle("sphere", (0.3, 0.0, 0.1), radius=-1.0, name="ball"))
