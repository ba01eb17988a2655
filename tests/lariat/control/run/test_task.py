"""The task changes by requests, and says why when it does not."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from lariat.control.run.reasons import ReasonCode
from lariat.control.run.state_machine import RunEvent, RunState
from lariat.control.run.task import RequestRefused, Task
from lariat.scenario import Goal
from tests.services.controller.cell import grips


def task(resettable: bool = True) -> Task:
    left, right = grips((-0.2, 0.0, 0.3), (0.2, 0.0, 0.3))
    goal = Goal(np.linspace(left.position, right.position, 10), left, right)
    return Task(goal, settings={"adapt": "false"}, resettable=resettable)


def test_resumed_run_is_the_same_run() -> None:
    t = task()
    t.start(5)
    t.pause()
    t.start(9)
    assert (t.run, t.run_started, t.state) == ("run-1", 5, RunState.RUNNING)
    t.stop()
    t.start(20)
    assert (t.run, t.run_started) == ("run-2", 20)


def test_new_goal_asks_for_a_path_and_ends_what_was_reached() -> None:
    t = task()
    t.start(1)
    t.apply(RunEvent.SETTLE, ReasonCode.SETTLED)
    before = (t.goal_revision, t.replan_count)
    t.set_goal(t.goal)
    assert (t.goal_revision, t.replan_count) == (before[0] + 1, before[1] + 1)
    assert t.state is RunState.IDLE


def test_revision_grows_with_every_change() -> None:
    t = task()
    revisions = [t.revision]
    for change in (lambda: t.start(1), t.pause, t.stop, t.reset, lambda: t.set("adapt", "true")):
        change()
        revisions.append(t.revision)
    assert all(b > a for a, b in pairwise(revisions))


@pytest.mark.parametrize(
    ("action", "words"),
    [
        (lambda t: t.pause(), "cannot pause while idle"),
        (lambda t: t.reset(), "only a simulation"),
        (lambda t: t.set("colour", "red"), "there are adapt"),
        (lambda t: t.set("adapt", "perhaps"), "must be a bool"),
    ],
)
def test_refusals_name_the_way_out(action, words: str) -> None:
    with pytest.raises(RequestRefused, match=words):
        action(task(resettable=False))
