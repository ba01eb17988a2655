"""Goals without the editor: the present shape, and the goal before."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from dashboard.action_queue import ActionQueue
from dashboard.editors.goal_shortcuts import GoalShortcuts
from dashboard.outbox import Outbox
from dashboard.web.private_viser import PrivateViser
from shared import topics
from shared.messages import ArmState, ArmStates, Goal, NodeChain, TaskRequest, TaskState

ROPE = NodeChain(positions=np.arange(15.0))
ARMS = ArmStates(
    arms=[
        ArmState(arm=side, position=[x, 0.0, 0.0], orientation=[1.0, 0.0, 0.0, 0.0])
        for side, x in (("left", 0.0), ("right", 1.0))
    ]
)


class Shortcuts(GoalShortcuts):
    """Shortcuts whose buttons are pressed by the test."""

    def __init__(self, private: PrivateViser) -> None:
        self.outbox = Outbox("test")
        super().__init__(private.server.gui, ActionQueue(), self.outbox)

    def see(self, revision: int, x: float, part: tuple[float, ...] = ()) -> None:
        goal = Goal(positions=[x] * 15, part=part)
        self.update(TaskState(goal=goal, goal_revision=revision), ROPE, ARMS)

    def sent(self) -> list[Goal]:
        requests = [p for p in self.outbox.take(1) if p.topic == topics.TASK_REQUEST]
        assert all(p.message.action == TaskRequest.SET_GOAL for p in requests)
        return [p.message.goal for p in requests]


@pytest.fixture
def shortcuts() -> Iterator[Shortcuts]:
    private = PrivateViser("test")
    try:
        yield Shortcuts(private)
    finally:
        private.close()


def test_goals_are_undone_one_after_the_other(shortcuts: Shortcuts) -> None:
    for revision, x in ((1, 0.1), (2, 0.2), (3, 0.3)):
        shortcuts.see(revision, x)
    shortcuts._request_undo()
    assert [g.positions[0] for g in shortcuts.sent()] == [0.2]
    # The answer is no new goal to undo.
    shortcuts.see(4, 0.2)
    shortcuts._request_undo()
    assert [g.positions[0] for g in shortcuts.sent()] == [0.1]
    shortcuts.see(5, 0.1)
    shortcuts._request_undo()
    assert shortcuts.sent() == []


def test_whole_goal_returns_after_one_of_a_part_of_the_same_shape(shortcuts: Shortcuts) -> None:
    shortcuts.see(1, 0.1)
    shortcuts.see(2, 0.1, part=(0.2, 0.4))
    shortcuts._request_undo()
    assert [list(g.part) for g in shortcuts.sent()] == [[]]


def test_present_shape_brings_the_grips_that_hold_it(shortcuts: Shortcuts) -> None:
    shortcuts._request_present()
    assert shortcuts.sent() == []
    shortcuts.see(1, 0.1)
    shortcuts._request_present()
    (goal,) = shortcuts.sent()
    assert list(goal.positions) == list(ROPE.positions)
    assert list(goal.right.position) == [1.0, 0.0, 0.0]


def test_rope_that_is_lost_is_no_goal(shortcuts: Shortcuts) -> None:
    lost = NodeChain(positions=ROPE.positions, lost="no camera")
    shortcuts.update(TaskState(), lost, ARMS)
    shortcuts._request_present()
    assert shortcuts.sent() == []
