"""Goals that change at given times of a run."""

from __future__ import annotations

import numpy as np

from lariat.control.run.goal_events import GoalEvents
from lariat.control.run.reasons import ReasonCode
from lariat.control.run.state_machine import RunEvent, RunState
from lariat.control.run.task import Task
from lariat.scenario import Goal, Shape
from lariat.scenario.sections import Event
from lariat.trajectory import SECOND
from tests.lariat.control.run.test_task import task
from tests.services.controller.cell import grips

FIRST = Shape(line=((-0.2, 0.0, 0.3), (0.1, 0.0, 0.3)))
SECOND_SHAPE = Shape(line=((-0.2, 0.0, 0.3), (0.2, 0.0, 0.3)))
EVENTS = (
    Event(4.0, goal=SECOND_SHAPE),
    Event(1.0, remove_obstacle="post"),
    Event(2.0, goal=FIRST),
)
START = 10 * SECOND


def goal_from(shape: Shape) -> Goal:
    """Goal that is a straight line between the grips of a shape."""
    assert shape.line is not None
    left, right = grips(*shape.line)
    return Goal(np.linspace(left.position, right.position, 10), left, right)


def started() -> Task:
    """Task with a run that has begun at `START`."""
    t = task()
    t.start(START)
    return t


def right_end(t: Task) -> float:
    """Coordinate x of the goal's right grip [m]."""
    return float(t.goal.right.position[0])


def test_goals_change_in_the_order_of_their_times() -> None:
    events, t = GoalEvents(EVENTS), started()
    before = t.goal_revision
    events.apply_due(START + 2 * SECOND - 1, t, goal_from)
    assert t.goal_revision == before
    events.apply_due(START + 2 * SECOND, t, goal_from)
    assert (t.goal_revision, right_end(t)) == (before + 1, 0.1)
    assert (t.state, t.reason.code) == (RunState.RUNNING, ReasonCode.SCHEDULED_GOAL)
    assert " 2 s " in str(t.reason)
    events.apply_due(START + 3 * SECOND, t, goal_from)
    assert t.goal_revision == before + 1
    events.apply_due(START + 4 * SECOND, t, goal_from)
    assert (t.goal_revision, right_end(t)) == (before + 2, 0.2)


def test_all_goals_that_are_due_are_set_in_one_step() -> None:
    events, t = GoalEvents(EVENTS), started()
    events.apply_due(START + 9 * SECOND, t, goal_from)
    assert right_end(t) == 0.2
    assert t.goal_revision == 3


def test_no_goal_changes_while_the_arms_are_not_controlled() -> None:
    events, t = GoalEvents(EVENTS), started()
    t.pause()
    events.apply_due(START + 9 * SECOND, t, goal_from)
    assert t.goal_revision == 1


def test_restart_sets_all_goals_again() -> None:
    events, t = GoalEvents(EVENTS), started()
    events.apply_due(START + 9 * SECOND, t, goal_from)
    t.stop()
    t.start(2 * START)
    events.apply_due(2 * START + 9 * SECOND, t, goal_from)
    assert t.goal_revision == 3
    events.restart()
    events.apply_due(2 * START + 2 * SECOND, t, goal_from)
    assert (t.goal_revision, right_end(t)) == (4, 0.1)


def test_next_goal_is_set_when_the_one_before_it_is_reached() -> None:
    events, t = GoalEvents((), (FIRST, SECOND_SHAPE)), started()
    assert not events.apply_reached(t, goal_from)
    for number, end in ((2, 0.1), (3, 0.2)):
        t.apply(RunEvent.SETTLE, ReasonCode.SETTLED)
        assert events.apply_reached(t, goal_from)
        assert (t.state, right_end(t)) == (RunState.RUNNING, end)
        assert f"{number} of 3" in str(t.reason)
        assert not events.apply_reached(t, goal_from)
    t.apply(RunEvent.SETTLE, ReasonCode.SETTLED)
    assert not events.apply_reached(t, goal_from)
    assert t.state is RunState.REACHED


def test_every_run_has_all_goals() -> None:
    events, t = GoalEvents((), (FIRST,)), started()
    t.apply(RunEvent.SETTLE, ReasonCode.SETTLED)
    assert events.apply_reached(t, goal_from)
    t.apply(RunEvent.SETTLE, ReasonCode.SETTLED)
    t.start(2 * START)
    events.restart()
    t.apply(RunEvent.SETTLE, ReasonCode.SETTLED)
    assert events.apply_reached(t, goal_from)
