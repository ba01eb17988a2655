"""Stretch of a goal that counts: what people may type, and what it means."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.editors.counted_stretch import CountedStretch
from dashboard.scene.scene_view import SceneView
from dashboard.web.private_viser import PrivateViser
from lariat.geometry import polylines
from lariat.geometry.poses import Pose
from lariat.scenario import Goal, load
from shared.messages import GoalPreview, goal_message

SCENARIO = load("scenarios/three-cylinders.toml")
ROPE = SCENARIO.rope
NODES = np.linspace([0.0, 0.0, 0.3], [ROPE.length, 0.0, 0.3], ROPE.node_count)
EDGE = ROPE.length / (ROPE.node_count - 1)


def goal(**fields: Any) -> Goal:
    level = np.array([0.5, 0.5, 0.5, 0.5])
    return Goal(NODES, Pose(NODES[0], level), Pose(NODES[-1], level), **fields)


@pytest.fixture
def private() -> Iterator[PrivateViser]:
    private = PrivateViser("test")
    yield private
    private.close()


@pytest.fixture
def stretch(private: PrivateViser) -> CountedStretch:
    return CountedStretch(private.server.gui, ROPE, ActionQueue(), lambda: None)


def test_whole_rope_is_no_part(stretch: CountedStretch) -> None:
    assert stretch.part is None
    assert np.all(stretch.counted(NODES))
    stretch._take(0.0, ROPE.length)
    assert stretch.part is None
    assert stretch.problem == ""


def test_stretch_counts_the_nodes_between_its_ends(stretch: CountedStretch) -> None:
    stretch._take(4 * EDGE, 9 * EDGE)
    assert stretch.part == pytest.approx((4 * EDGE, 9 * EDGE))
    assert stretch.problem == ""
    assert np.flatnonzero(stretch.counted(NODES)).tolist() == [4, 5, 6, 7, 8, 9]


@pytest.mark.parametrize(
    ("begin", "end", "problem"),
    [
        (-0.001, 0.2, "lies between 0 and 450 mm"),
        (0.1, 0.4501, "lies between 0 and 450 mm"),
        (np.nan, 0.2, "lies between 0 and 450 mm"),
        (0.1, np.nan, "lies between 0 and 450 mm"),
        (-np.inf, np.inf, "lies between 0 and 450 mm"),
        (0.0, 0.44, "more than 90 % of the rope; give at most 405 mm, or all of it: 0 and 450"),
        (0.2, 0.1, "ends before it begins"),
        (0.2, 0.2, "ends before it begins"),
        (4 * EDGE, 5 * EDGE, "holds 2 of the rope's nodes, which make no shape; give at least 35"),
    ],
)
def test_impossible_stretch_is_refused_with_the_way_out(
    stretch: CountedStretch, begin: float, end: float, problem: str
) -> None:
    stretch._take(begin, end)
    assert problem in stretch.problem
    assert np.all(stretch.counted(NODES))


def test_least_length_of_the_refusal_always_holds_enough_nodes(stretch: CountedStretch) -> None:
    for begin in np.linspace(0.0, ROPE.length - 0.035, 200):
        stretch._take(begin, begin + 0.035)
        assert stretch.problem == ""


def test_stretch_of_a_goal_is_taken_and_that_of_a_whole_goal_too(stretch: CountedStretch) -> None:
    stretch.take_goal(goal(part=(0.1, 0.3)))
    assert stretch.part == (0.1, 0.3)
    stretch.take_goal(goal())
    assert stretch.part is None


def test_goal_of_the_ends_stays_one(stretch: CountedStretch) -> None:
    stretch.take_goal(goal(ends_only=True))
    assert (stretch.part, stretch.problem) == (None, "")
    assert np.flatnonzero(stretch.counted(NODES)).tolist() == [0, len(NODES) - 1]
    applied = stretch.applied(goal(left_oriented=True))
    assert (applied.ends_only, applied.left_oriented) == (True, True)


def test_switch_between_ends_and_stretch_keeps_the_stretch(stretch: CountedStretch) -> None:
    stretch.take_goal(goal(part=(0.1, 0.3)))
    stretch._take_switch(True)
    applied = stretch.applied(goal())
    assert (applied.ends_only, applied.part) == (True, None)
    stretch._take_switch(False)
    applied = stretch.applied(goal(left_oriented=True, right_oriented=True))
    assert (applied.ends_only, applied.part) == (False, (0.1, 0.3))
    assert applied.oriented == (False, False)


def test_preview_tells_the_stretch_from_the_rest(private: PrivateViser) -> None:
    view = SceneView(private.server, SCENARIO, lambda _: None)
    preview = GoalPreview(reachable=True, goal=goal_message(goal()))
    counted = np.zeros(len(NODES), dtype=bool)
    counted[10:21] = True
    view.show_preview(preview, counted)
    beads = view._preview._nodes
    assert beads is not None
    colors, radii = np.array(beads.batched_colors), np.array(beads.batched_scales)[:, 0]
    assert np.all(colors[counted] == palette.GOAL)
    assert np.all(colors[~counted] == palette.FREE)
    assert np.flatnonzero(radii > 1.5 * np.min(radii)).tolist() == [10, 20]
    view.show_preview(preview, np.ones(len(NODES), dtype=bool))
    assert np.all(np.array(beads.batched_colors) == palette.GOAL)
    assert np.ptp(np.array(beads.batched_scales)) == 0.0


def test_goal_of_the_ends_shows_that_its_shape_is_free(private: PrivateViser) -> None:
    view = SceneView(private.server, SCENARIO, lambda _: None)
    ends = polylines.ends_of(len(NODES))
    view.show_goal(goal(ends_only=True))
    beads = view._goal._nodes
    assert beads is not None
    colors = np.array(beads.batched_colors)
    assert np.all(colors[ends] == palette.GOAL)
    assert np.all(colors[~ends] == palette.FREE)
    view.show_goal(goal())
    assert np.all(np.array(beads.batched_colors) == palette.GOAL)
