from __future__ import annotations

from dashboard.action_queue import ActionQueue


def test_actions_are_taken_once_in_their_order() -> None:
    actions = ActionQueue()
    done: list[int] = []
    for k in range(3):
        actions.put(lambda k=k: done.append(k))
    for action in actions.take():
        action()
    assert done == [0, 1, 2]
    assert list(actions.take()) == []
