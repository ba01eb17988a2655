"""Goals that are dragged: what "Set goal" sets."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from dashboard.action_queue import ActionQueue
from dashboard.editors.goal_editor import GoalEditor
from dashboard.outbox import Outbox
from dashboard.scene.scene_view import SceneView
from dashboard.web.private_viser import PrivateViser
from lariat.scenario import load
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import Goal, GoalPreview

SCENARIO = load("three-cylinders")
LEFT = SCENARIO.grips(SCENARIO.goal)[0].position


class Editor(GoalEditor):
    """Editor whose fields and buttons are used by the test, and whose controller it is."""

    def __init__(self, private: PrivateViser) -> None:
        self.outbox = Outbox("test")
        view = SceneView(private.server, SCENARIO, lambda name: None)
        super().__init__(
            private.server, SCENARIO, ActionQueue(), self.outbox, view, lambda note: None, True
        )
        self._time = 0

    def raise_left(self, height: float) -> None:
        self._take_field("left", LEFT + np.array([0.0, 0.0, height]))

    def preview(self) -> None:
        """Draft the ends where they are, and take the controller's answer."""
        self._time += SECOND
        self.update(None, None, self._time)
        (draft,) = [p.message for p in self.outbox.take(1) if p.topic == topics.TASK_GOAL_DRAFT]
        nodes = np.zeros(3 * SCENARIO.rope.node_count)
        goal = Goal(left=draft.left, right=draft.right, positions=nodes)
        answer = GoalPreview(draft=draft.id, reachable=True, goal=goal)
        self.update(None, answer, self._time)

    def set(self) -> list[float]:
        """Press "Set goal", and return the heights of the left end that are requested [m]."""
        self._request_goal()
        sent = [p.message for p in self.outbox.take(1) if p.topic == topics.TASK_REQUEST]
        return [message.goal.left.position[2] - LEFT[2] for message in sent]


@pytest.fixture
def editor() -> Iterator[Editor]:
    private = PrivateViser("test")
    try:
        editor = Editor(private)
        editor._toggle()
        editor.preview()
        yield editor
    finally:
        private.close()


def test_a_goal_is_set_as_it_was_previewed(editor: Editor) -> None:
    assert editor.set() == []
    editor.raise_left(0.02)
    editor.preview()
    assert editor.set() == [pytest.approx(0.02)]


def test_a_goal_that_was_changed_since_its_preview_is_not_set(editor: Editor) -> None:
    editor.raise_left(0.02)
    editor.preview()
    editor.raise_left(0.03)
    # As from a browser that does not know of the change yet.
    assert editor.set() == []
    editor.preview()
    assert editor.set() == [pytest.approx(0.03)]
