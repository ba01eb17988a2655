from __future__ import annotations

from collections.abc import Iterator

import pytest

from dashboard.action_queue import ActionQueue
from dashboard.editors.obstacle_editor import ObstacleEditor
from dashboard.editors.route_editor import NOTHING, RouteEditor
from dashboard.outbox import Outbox
from dashboard.web.private_viser import PrivateViser
from lariat.geometry.cable_routes import clip_openings
from lariat.scenario import load
from shared import topics
from shared.messages import Scene, scene_obstacles

SCENARIO = load("harness-board")
PEGS = ["left of near", "right of near", "left of far", "right of far"]


@pytest.fixture
def private() -> Iterator[PrivateViser]:
    private = PrivateViser("test")
    yield private
    private.close()


@pytest.fixture
def actions() -> ActionQueue:
    return ActionQueue()


@pytest.fixture
def editor(private: PrivateViser, actions: ActionQueue) -> RouteEditor:
    editor = RouteEditor(private.server.gui, actions, lambda: None)
    editor.take_scene(SCENARIO.bodies)
    editor.take_route(("low", "high"))
    editor.show(True)
    return editor


def test_what_is_not_on_the_route_may_be_added(editor: RouteEditor) -> None:
    assert list(editor._new.options) == ["middle", *PEGS]
    editor._stop.value = "1 low"  # pyright: ignore[reportAttributeAccessIssue]
    editor._insert("left of near")
    assert editor.route == ("low", "left of near", "high")
    # The next one is added behind it.
    assert editor._stop.value == "2 left of near"
    assert list(editor._new.options) == ["middle", *PEGS[2:]]


def test_the_chosen_stop_is_moved_within_the_route_and_removed(editor: RouteEditor) -> None:
    editor._stop.value = "2 high"  # pyright: ignore[reportAttributeAccessIssue]
    for move, route in (
        ("Down", ("low", "high")),
        ("Up", ("high", "low")),
        ("Up", ("high", "low")),
        ("Remove", ("low",)),
        ("Remove", ()),
        ("Remove", ()),
    ):
        editor._change(move)
        assert editor.route == route
    assert editor._stop.value == NOTHING
    editor._insert(NOTHING)
    editor._insert("middle")
    assert editor.route == ("middle",)


def test_what_is_chosen_at_a_press_is_added_whatever_is_chosen_before_the_next_step(
    editor: RouteEditor, actions: ActionQueue
) -> None:
    editor.take_route(("middle",))
    for entry in ("right of far", "high"):
        editor._new.value = entry  # pyright: ignore[reportAttributeAccessIssue]
        editor._press_add()
    actions.run()
    assert editor.route == ("middle", "right of far", "high")


def test_held_clips_are_marked_in_the_list(editor: RouteEditor) -> None:
    editor.mark(["high"])
    low, high = editor._list.content.split("<li>")[1:]
    assert "✓" not in low
    assert "✓ laid" in high


def test_without_clips_there_is_nothing_to_edit(editor: RouteEditor) -> None:
    editor.take_route(())
    editor.take_scene(load("three-cylinders").bodies)
    assert not any(h.visible for h in (editor._list, editor._stop, editor._new, editor._add))


def test_a_clip_is_moved_and_turned_as_a_whole(private: PrivateViser) -> None:
    outbox = Outbox("dashboard-ab")
    editor = ObstacleEditor(private.server, SCENARIO, ActionQueue(), outbox, lambda _: None)
    editor.update(SCENARIO.bodies)
    assert "low-left" not in editor._selection.options
    editor.select("low-right")
    assert editor._selection.value == "low"
    before = clip_openings(SCENARIO.bodies)["low"]
    # Turned by a quarter about the vertical, and tilted by hand.
    editor._request_move((0.1, 0.2, 0.05), (0.7, 0.1, 0.0, 0.7))
    messages = [p.message for p in outbox.take(1) if p.topic == topics.SCENE_REQUEST]
    scene = scene_obstacles(Scene(obstacles=[m.obstacle for m in messages]))
    after = clip_openings(scene)["low"]
    assert after.foot == pytest.approx((0.1, 0.2, 0.05))
    assert after.half_width == pytest.approx(before.half_width)
    assert (after.along[:2], after.height) == (pytest.approx((0.0, 1.0), abs=0.05), before.height)
    editor._request_undo()
    messages = [p.message for p in outbox.take(1) if p.topic == topics.SCENE_REQUEST]
    scene = scene_obstacles(Scene(obstacles=[m.obstacle for m in messages]))
    assert clip_openings(scene)["low"].foot == pytest.approx(before.foot)
