"""Motions of obstacles in the runs of a task."""

from __future__ import annotations

from pathlib import Path

import pytest

from lariat.perception.scene import SceneChangeRefused, SceneOwner
from lariat.scenario import load
from lariat.trajectory import SECOND
from services.perception.scene_motion import MOVING_PERIOD, SceneMotionPublisher
from shared.messages import SceneMotion, TaskState

SCENARIO = load(Path(__file__).parents[3] / "scenarios" / "crossing.toml")


def newest(publisher: SceneMotionPublisher, now: int) -> SceneMotion | None:
    messages = [publication.message for publication in publisher.due(now)]
    assert len(messages) <= 1
    if not messages:
        return None
    (message,) = messages
    assert isinstance(message, SceneMotion)
    return message


def test_motion_belongs_to_its_run_until_the_reset():
    publisher = SceneMotionPublisher(SCENARIO)
    before = newest(publisher, SECOND)
    assert before is not None
    assert not before.motions
    run = TaskState(run_started=10 * SECOND)
    publisher.take_task(run)
    during = newest(publisher, 13 * SECOND)
    assert during is not None
    assert during.run_started == 10 * SECOND
    (cart,) = during.motions
    assert list(cart.times) == [10 * SECOND, 16 * SECOND]
    assert list(cart.position) == pytest.approx([0.0, 0.02, 0.16])
    assert list(cart.velocity) == pytest.approx([-0.2, 0.0, 0.0])
    publisher.reset(run)
    publisher.take_task(run)
    after = newest(publisher, 14 * SECOND)
    assert after is not None
    assert (after.run_started, len(after.motions)) == (0, 0)


def test_motion_is_published_often_while_something_moves_and_rarely_after():
    publisher = SceneMotionPublisher(SCENARIO)
    publisher.take_task(TaskState(run_started=SECOND))
    step = MOVING_PERIOD // 2
    assert [newest(publisher, SECOND + k * step) is None for k in range(4)] == [
        *(False, True, False, True)
    ]
    assert newest(publisher, 20 * SECOND) is not None
    assert newest(publisher, 20 * SECOND + MOVING_PERIOD) is None


def test_obstacle_with_a_path_is_not_moved_by_a_request():
    scene = SceneOwner(SCENARIO.bodies, (), 0.004, {"cart"})
    with pytest.raises(SceneChangeRefused, match=r"'cart'.*path"):
        scene.move("cart", (0.0, 0.5, 0.16))
