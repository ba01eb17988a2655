"""Requests of a person, and the condition of the arms that a start needs."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from lariat.control.run.arm_condition import ArmCondition
from lariat.control.run.reasons import Reason, ReasonCode
from lariat.control.run.requests import Request, RequestAction, carry_out, preview
from lariat.control.run.state_machine import RunState
from lariat.control.run.task import RequestRefused, Task
from lariat.scenario import Goal
from tests.lariat.control.run.test_task import task

READY = ArmCondition(True, True, "braked", 0, 0, "")


class Goals:
    """Factory of one goal, which may refuse it."""

    def __init__(self, goal: Goal, refusal: str = "") -> None:
        self.goal, self.refusal = goal, refusal

    def from_request(self, request: Goal, obstacles: tuple, pull: object = None) -> Goal:
        return self.goal

    def check(self, goal: Goal, obstacles: tuple) -> None:
        if self.refusal:
            raise RequestRefused(self.refusal)


def request(
    t: Task,
    action: RequestAction | None,
    arms: ArmCondition | None = READY,
    refusal: str = "",
    obstruction: Reason | None = None,
    **fields: object,
) -> bool:
    """Carry out a request with the id `a`; whether a run has begun."""
    made = Request("a", action, **fields)  # pyright: ignore
    goals = Goals(replace(t.goal, turns=1.0), refusal)
    return carry_out(made, t, goals, (), arms, 7, obstruction)  # pyright: ignore


def test_start_begins_a_run_and_a_second_one_is_refused() -> None:
    t = task()
    assert request(t, RequestAction.START)
    assert (t.state, t.run_started, t.last_request, t.refusal) == (RunState.RUNNING, 7, "a", "")
    assert not request(t, RequestAction.START)
    assert "already running" in t.refusal


def test_start_that_resumes_a_paused_run_begins_no_other() -> None:
    t = task()
    request(t, RequestAction.START)
    request(t, RequestAction.PAUSE)
    assert not request(t, RequestAction.START)
    assert (t.state, t.run) == (RunState.RUNNING, "run-1")


@pytest.mark.parametrize(
    ("arms", "words"),
    [
        (None, "have not reported their poses"),
        (replace(READY, armed=False, available=False), r"are disarmed \(braked\)"),
        (replace(READY, available=False), r"the arms hold \(braked\); acknowledge"),
    ],
)
def test_start_without_ready_arms_is_refused(arms: ArmCondition | None, words: str) -> None:
    t = task()
    assert not request(t, RequestAction.START, arms)
    assert t.state is RunState.IDLE
    assert re.search(words, t.refusal)


def test_start_with_an_obstruction_is_refused_with_its_reason() -> None:
    t = task()
    reason = Reason(ReasonCode.WAITING_FOR_GRIPS, {"problem": "too far apart"})
    assert not request(t, RequestAction.START, obstruction=reason)
    assert "too far apart" in t.refusal


def test_goal_is_replaced_only_when_it_passes_its_checks() -> None:
    t = task()
    request(t, RequestAction.SET_GOAL, refusal="too long", goal=t.goal)
    assert (t.goal.turns, t.goal_revision, t.refusal) == (0.0, 1, "too long")
    request(t, RequestAction.SET_GOAL, goal=t.goal)
    assert (t.goal.turns, t.goal_revision, t.refusal) == (1.0, 2, "")


@pytest.mark.parametrize("state", [RunState.IDLE, RunState.REACHED, RunState.FAILED])
def test_goal_of_a_person_who_agreed_to_the_motion_is_followed_by_a_real_arm_too(
    state: RunState,
) -> None:
    t = task()
    t.resettable, t.state = False, state
    assert request(t, RequestAction.SET_GOAL, goal=t.goal, move=True)
    assert t.state is RunState.RUNNING
    request(t, RequestAction.PAUSE)
    assert not request(t, RequestAction.SET_GOAL, goal=t.goal, move=True)
    assert t.state is RunState.PAUSED


@pytest.mark.parametrize("state", [RunState.REACHED, RunState.FAILED])
def test_new_goal_after_a_run_is_followed_in_a_simulation(state: RunState) -> None:
    t = task()
    request(t, RequestAction.START)
    t.state = state
    assert request(t, RequestAction.SET_GOAL, goal=t.goal)
    assert (t.state, t.run) == (RunState.RUNNING, "run-2")


def test_new_goal_waits_for_a_start_beside_a_real_arm_and_after_a_stop() -> None:
    real, stopped, held = task(), task(), task()
    real.resettable = False
    for t in (real, stopped, held):
        request(t, RequestAction.START)
        t.state = RunState.REACHED
    request(stopped, RequestAction.STOP)
    for t in (real, stopped):
        assert not request(t, RequestAction.SET_GOAL, goal=t.goal)
    unready = replace(READY, available=False)
    assert not request(held, RequestAction.SET_GOAL, unready, goal=held.goal, move=True)
    for t in (real, stopped, held):
        assert (t.state, t.refusal, t.goal.turns) == (RunState.IDLE, "", 1.0)


def test_settings_change_by_key_and_value() -> None:
    t = task()
    request(t, RequestAction.SET, key="adapt", value="true")
    assert t.adapts


def test_unknown_action_is_answered_and_changes_nothing() -> None:
    t = task()
    assert not request(t, None)
    assert (t.state, t.last_request, t.refusal) == (RunState.IDLE, "a", "")


def test_preview_holds_the_goal_and_the_reason_why_it_is_refused() -> None:
    goal = task().goal
    refused = preview(goal, None, Goals(goal, "in the post"), (), False)  # pyright: ignore
    assert (refused.goal, refused.problem) == (goal, "in the post")
    allowed = preview(goal, None, Goals(goal), (), True)  # pyright: ignore
    assert np.array_equal(allowed.goal.nodes, goal.nodes)  # pyright: ignore
    assert allowed.problem == ""


def test_node_is_not_pulled_while_a_run_goes_on() -> None:
    pulled = (3, np.zeros(3))
    refused = preview(task().goal, pulled, Goals(task().goal), (), running=True)  # pyright: ignore
    assert refused.goal is None
    assert "pause" in refused.problem
