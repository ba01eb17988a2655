"""Steps of the controller from messages to publications."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lariat.control.run.reasons import ReasonCode
from lariat.control.run.state_machine import RunEvent, RunState
from lariat.scenario import load
from lariat.trajectory import SECOND
from services.controller.service import ControllerService, build
from shared import messages, topics
from shared.messages import ArmState, ArmStates, GoalDraft, TaskRequest, TaskState, chain
from shared.runtime.service import Inbox, Publication, Received

SCENARIO = load(Path(__file__).parents[3] / "scenarios" / "three-cylinders.toml")
LEVEL = [0.5, 0.5, 0.5, 0.5]


def arms(now: int, distance: float) -> ArmStates:
    sides = (("left", -0.2), ("right", distance - 0.2))
    places = [
        ArmState(arm=side, driver="ideal", position=[x, 0.0, 0.3], orientation=LEVEL)
        for side, x in sides
    ]
    return ArmStates(stamp=now, mode=ArmStates.ARMED, may_move=True, arms=places, reset_count=1)


def inbox(now: int, distance: float, newest: dict[str, Received], *requests: TaskRequest) -> Inbox:
    def items(*messages: object) -> list[Received]:
        return [Received(message, "sender", 0, now) for message in messages]

    arrived = {topics.ARM_STATE.key: items(arms(now, distance))}
    return Inbox(newest, {**arrived, topics.TASK_REQUEST.key: items(*requests)})


def observe(service: ControllerService, now: int, p_wrong: float = 0.0, aside: float = 0.0) -> None:
    """Hand over an observation that agrees with the estimate, or lies aside of it [m]."""
    nodes = service.controller.rope.estimator.nodes + np.array([0.0, aside, 0.0])
    rope = messages.NodeChain(stamp=now, positions=nodes.ravel(), p_wrong=p_wrong)
    arrived = {topics.ROPE_NODES.key: [Received(rope, "perception", 0, now)]}
    list(service.step(Inbox({}, arrived), now))


def published(
    service: ControllerService, now: int, distance: float, *requests: TaskRequest
) -> list[Publication]:
    """Publications of one step."""
    return list(service.step(inbox(now, distance, {}, *requests), now))


def step(
    service: ControllerService, now: int, distance: float, *requests: TaskRequest
) -> TaskState:
    """State of the task after one step."""
    publications = published(service, now, distance, *requests)
    (state,) = (p.message for p in publications if p.topic is topics.TASK_STATE)
    assert isinstance(state, TaskState)
    return state


def test_settings_of_a_running_cell_act_at_once() -> None:
    service = build(SCENARIO, "session")
    controller, loop = service.controller, service.controller._loop
    before = step(service, SECOND, 0.4)
    assert before.settings["speed_weight"] == "0.02"
    settings = {"speed_weight": "0.5", "horizon": "7", "clearance": "0.03", "pace": "0.5"}
    requests = [
        TaskRequest(id=key, action=TaskRequest.SET, key=key, value=value)
        for key, value in settings.items()
    ]
    state = step(service, 2 * SECOND, 0.4, *requests)
    assert state.refusal == ""
    assert settings.items() <= dict(state.settings).items()
    optimizer = loop.controller.optimizer
    assert (optimizer.step_count, optimizer.weights.speed) == (7, 0.5)  # pyright: ignore[reportAttributeAccessIssue]
    assert controller.scene.avoidance(controller.task, 1.0).clearance == 0.03
    # Another path, at the new pace, and a run keeps it.
    assert (state.pace, state.replan_count) == (0.5, before.replan_count + 2)
    step(service, 3 * SECOND, 0.4, TaskRequest(id="1", action=TaskRequest.START))
    assert controller.task.pace == 0.5
    refused = TaskRequest(id="2", action=TaskRequest.SET, key="pace", value="3")
    state = step(service, 4 * SECOND, 0.4, refused)
    assert "control.pace = 3" in state.refusal
    assert state.settings["pace"] == "0.5"


def test_tension_of_the_rope_is_published_where_it_is_limited() -> None:
    assert step(build(SCENARIO, "session"), SECOND, 0.4).tension == 0.0
    limited = replace(SCENARIO, limits=replace(SCENARIO.limits, tension=2.0))
    # Half of its weight hangs from each end, which carries it by shear in part.
    weight = 9.81 * SCENARIO.rope.linear_density * SCENARIO.rope.length
    assert 0.3 * weight < step(build(limited, "session"), SECOND, 0.4).tension < weight


def test_a_route_without_its_nodes_is_refused() -> None:
    goal = messages.Goal(left=messages.Grip(), right=messages.Grip(), route=["clip"])
    request = TaskRequest(id="1", action=TaskRequest.SET_GOAL, goal=goal)
    state = step(build(SCENARIO, "session"), SECOND, 0.4, request)
    assert "needs the nodes of the laid rope" in state.refusal


def test_controller_waits_for_grips_beyond_the_reach_of_the_rope() -> None:
    service = build(SCENARIO, "session")
    start = TaskRequest(id="1", action=TaskRequest.START)
    state = step(service, SECOND, 0.6, start)
    assert "grips" in state.refusal
    assert "grips" in service.note
    # A person has moved them within the reach of the rope.
    state = step(service, 2 * SECOND, 0.4, start)
    assert (state.refusal, service.note) == ("", "")
    assert service.controller.task.state is RunState.RUNNING
    # Moved too far away again during the run, they stretch the model, without an error.
    for k in range(3, 6):
        step(service, k * SECOND, 0.6)


def test_run_asks_once_for_a_path_after_an_older_failure() -> None:
    service = build(SCENARIO, "session")
    step(service, SECOND, 0.4)
    task = service.controller.task

    def receive_failure(now: int, stamp: int, *requests: TaskRequest) -> None:
        failure = messages.Path(
            stamp=stamp,
            goal_revision=task.goal_revision,
            replan_count=task.replan_count,
            reason="no way",
        )
        newest = {topics.CONTROLLER_PATH.key: Received(failure, "planner", 0, now)}
        observe(service, now)
        list(service.step(inbox(now, 0.4, newest, *requests), now))

    receive_failure(2 * SECOND, SECOND, TaskRequest(id="1", action=TaskRequest.START))
    assert (task.state, task.replan_count) == (RunState.RUNNING, 1)
    receive_failure(3 * SECOND, SECOND)
    assert (task.state, str(task.reason)) == (RunState.FAILED, "no way")
    receive_failure(4 * SECOND, SECOND, TaskRequest(id="2", action=TaskRequest.START))
    assert task.state is RunState.RUNNING
    # A failure that is newer than the run ends it.
    receive_failure(5 * SECOND, 5 * SECOND)
    assert task.state is RunState.FAILED


def test_the_rope_begins_a_step_whose_setpoints_come_first() -> None:
    pathless = replace(SCENARIO, control=replace(SCENARIO.control, planner=False))
    service = build(pathless, "session")
    assert service.wakes == (topics.ROPE_NODES,)
    published(service, SECOND, 0.4, TaskRequest(id="1", action=TaskRequest.START))
    observe(service, SECOND)
    keys = [p.topic.key for p in published(service, SECOND + SECOND // 50, 0.4)]
    assert keys[:2] == [topics.ARM_SETPOINTS.key, topics.CONTROLLER_PLAN.key]


def test_a_rope_that_may_be_another_is_no_observation_and_the_hold_says_so() -> None:
    service = build(SCENARIO, "session")

    def hold(now: int) -> str:
        (reason,) = (
            p.message.reason
            for p in published(service, now, 0.4)
            if p.topic is topics.ARM_SETPOINTS
        )
        return reason

    published(service, SECOND, 0.4, TaskRequest(id="1", action=TaskRequest.START))
    observe(service, SECOND)
    assert hold(SECOND + SECOND // 10) == "waiting for a path"
    before, now = service.controller.rope.estimator.nodes, SECOND
    for _ in range(25):
        now += SECOND // 50
        published(service, now, 0.4)
        observe(service, now, p_wrong=0.8, aside=0.02)
    assert "probability 0.80" in hold(now)
    np.testing.assert_allclose(service.controller.rope.estimator.nodes, before, atol=1e-3)
    observe(service, now, p_wrong=0.01)
    assert hold(now) == "waiting for a path"


def test_duration_of_a_run_ends_with_the_run() -> None:
    service = build(SCENARIO, "session")
    published(service, SECOND, 0.4, TaskRequest(id="1", action=TaskRequest.START))
    published(service, 2 * SECOND, 0.4)
    published(service, 3 * SECOND, 0.4, TaskRequest(id="2", action=TaskRequest.STOP))
    publications = published(service, 9 * SECOND, 0.4)
    (result,) = (p.message for p in publications if p.topic is topics.RUN_RESULT)
    assert result.duration == 2.0


@pytest.mark.parametrize("action", [TaskRequest.RESET, TaskRequest.RESTORE, TaskRequest.STOP])
def test_verdict_of_a_run_stays_whatever_follows(action: TaskRequest.Action) -> None:
    service = build(SCENARIO, "session")
    published(service, SECOND, 0.4, TaskRequest(id="1", action=TaskRequest.START))
    nearby = service.controller.rope.estimator.nodes + np.array([0.0, 0.0005, 0.0])
    service.controller.task.goal = replace(service.controller.task.goal, nodes=nearby)
    observe(service, SECOND)
    service.controller.task.apply(RunEvent.SETTLE, ReasonCode.SETTLED)
    publications = published(service, 2 * SECOND, 0.4)
    (reached,) = (p.message for p in publications if p.topic is topics.RUN_RESULT)
    assert reached.reached
    assert reached.error == pytest.approx(0.0005, rel=1e-3)
    published(service, 3 * SECOND, 0.4, TaskRequest(id="2", action=action))
    service.controller.progress.error = service.controller.progress.min_clearance = 1.0
    publications = published(service, 4 * SECOND, 0.4)
    (later,) = (p.message for p in publications if p.topic is topics.RUN_RESULT)
    assert later.stamp == 4 * SECOND
    later.stamp = reached.stamp
    assert later == reached


def test_restore_returns_to_the_goal_of_the_scenario_and_reset_keeps_the_one_set() -> None:
    service = build(SCENARIO, "session")
    before = step(service, SECOND, 0.4)
    moved = messages.Goal()
    moved.CopyFrom(before.goal)
    moved.left.position[1] += 0.02
    moved.right.position[1] += 0.02
    moved.positions[:] = (chain(before.goal.positions) + np.array([0.0, 0.02, 0.0])).ravel()
    goal = TaskRequest(id="1", action=TaskRequest.SET_GOAL, goal=moved)
    assert step(service, 2 * SECOND, 0.4, goal).refusal == ""
    kept = step(service, 3 * SECOND, 0.4, TaskRequest(id="2", action=TaskRequest.RESET))
    np.testing.assert_allclose(kept.goal.positions, moved.positions)
    assert kept.restore_count == before.restore_count
    back = step(service, 4 * SECOND, 0.4, TaskRequest(id="3", action=TaskRequest.RESTORE))
    np.testing.assert_allclose(back.goal.positions, before.goal.positions)
    assert (back.restore_count, back.reset_count) == (2, kept.reset_count + 1)


def test_draft_of_a_wound_goal_is_previewed_as_wound() -> None:
    service = build(load(SCENARIO.folder / "two-turns.toml"), "session")
    goal = service.controller.task.goal
    draft = GoalDraft(id="d", turns=goal.turns)
    draft.left.CopyFrom(messages.grip(goal.left))
    draft.right.CopyFrom(messages.grip(goal.right))
    arrived = {topics.TASK_GOAL_DRAFT.key: [Received(draft, "page", 0, SECOND)]}
    publications = list(service.step(Inbox({}, arrived), SECOND))
    (preview,) = (p.message for p in publications if p.topic is topics.TASK_GOAL_PREVIEW)
    assert preview.goal.turns == goal.turns != 0.0
    np.testing.assert_allclose(chain(preview.goal.positions), goal.nodes, atol=1e-4)


def test_controller_that_replaces_another_one_takes_over_the_count_of_resets() -> None:
    service = build(SCENARIO, "session")
    state = arms(SECOND, 0.4)
    state.reset_count = 6
    arrived = {topics.ARM_STATE.key: [Received(state, "gateway", 0, SECOND)]}
    (task,) = [
        p.message for p in service.step(Inbox({}, arrived), SECOND) if p.topic is topics.TASK_STATE
    ]
    assert isinstance(task, TaskState)
    assert task.reset_count == 6


def test_controller_that_knows_no_arms_states_no_count_of_resets() -> None:
    service = build(SCENARIO, "session")
    (task,) = [p.message for p in service.step(Inbox({}, {}), SECOND)]
    assert isinstance(task, TaskState)
    assert task.reset_count == 0


def test_request_that_cannot_be_handled_is_refused_and_the_next_one_is_taken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    service = build(SCENARIO, "session")

    def fail(*_: object) -> None:
        raise KeyError("x")

    with monkeypatch.context() as patch:
        patch.setattr("services.controller.service.task_request", fail)
        start = TaskRequest(id="1", action=TaskRequest.START)
        assert step(service, SECOND, 0.4, start).last_request == ""
    assert service.door.refused == 1
    start = TaskRequest(id="2", action=TaskRequest.START)
    assert step(service, 2 * SECOND, 0.4, start).last_request == "2"
