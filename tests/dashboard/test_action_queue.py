from __future__ import annotations

import pytest

from dashboard.action_queue import ActionQueue


def test_actions_run_once_in_their_order() -> None:
    actions = ActionQueue()
    done: list[int] = []
    for k in range(3):
        actions.put(lambda k=k: done.append(k))
    actions.run()
    assert done == [0, 1, 2]
    actions.run()
    assert done == [0, 1, 2]


def test_action_that_fails_is_logged_and_does_not_stop_the_others(
    caplog: pytest.LogCaptureFixture,
) -> None:
    actions = ActionQueue()
    done: list[str] = []
    actions.put(lambda: done.append(str(float("no number"))))
    actions.put(lambda: done.append("next"))
    actions.run()
    assert done == ["next"]
    assert "could not convert" in caplog.text
