from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

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


def test_values_that_a_person_gives_are_taken_and_those_that_the_page_sets_are_not() -> None:
    actions, taken, element = ActionQueue(), [], Element()
    actions.on_change(element, taken.append)
    actions.on_press(element, taken.append)
    for client in ("window 1", None):
        for call in element.calls:
            call(SimpleNamespace(client=client, target=SimpleNamespace(value=0.5)))
    actions.run()
    assert taken == [0.5, "window 1"]


class Element:
    """Element of a page, as far as it tells what people do with it."""

    def __init__(self) -> None:
        self.calls: list[Callable[[SimpleNamespace], object]] = []
        self.on_update = self.on_click = self.calls.append
