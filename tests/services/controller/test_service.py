"""The controller on the bus, with arms that stand anywhere."""

from __future__ import annotations

from pathlib import Path

from services.controller.run.state_machine import RunState
from services.controller.service import ControllerService, build
from shared import messages, topics
from shared.messages import ArmState, ArmStates, TaskRequest, TaskState
from shared.scenario import load
from shared.service import SECOND, Inbox, Publication, Received

SCENARIO = load(Path(__file__).parents[3] / "scenarios" / "three-cylinders.toml")
LEVEL = [0.5, 0.5, 0.5, 0.5]


def arms(now: int, apart: float) -> ArmStates:
    sides = (("left", -0.2), ("right", apart - 0.2))
    places = [
        ArmState(arm=side, driver="ideal", position=[x, 0.0, 0.3], orientation=LEVEL)
        for side, x in sides
    ]
    return ArmStates(stamp=now, mode=ArmStates.ARMED, arms=places)


def inbox(now: int, apart: float, newest: dict[str, Received], *requests: TaskRequest) -> Inbox:
    def items(*messages: object) -> list[Received]:
        return [Received(message, "somebody", 0, now) for message in messages]

    arrived = {topics.ARM_STATE.key: items(arms(now, apart))}
    return Inbox(newest, {**arrived, topics.TASK_REQUEST.key: items(*requests)})


def look(service: ControllerService, now: int) -> None:
    """Perception has just seen the rope where it is believed to be."""
    rope = messages.NodeChain(stamp=now, positions=service.estimator.nodes.ravel())
    arrived = {topics.ROPE_NODES.key: [Received(rope, "perception", 0, now)]}
    list(service.step(Inbox({}, arrived), now))


def said(
    service: ControllerService, now: int, apart: float, *requests: TaskRequest
) -> list[Publication]:
    """All that is published a second after the step before."""
    return list(service.step(inbox(now, apart, {}, *requests), now))


def step(service: ControllerService, now: int, apart: float, *requests: TaskRequest) -> TaskState:
    """The task's state a second after the one before."""
    published = said(service, now, apart, *requests)
    (state,) = (p.message for p in published if p.topic is topics.TASK_STATE)
    assert isinstance(state, TaskState)
    return state


def test_arms_farther_apart_than_the_rope_is_long_are_waited_for() -> None:
    service = build(SCENARIO, "session")
    start = TaskRequest(id="1", action=TaskRequest.START)
    state = step(service, SECOND, 0.6, start)
    assert "bring the grips together" in state.refusal
    assert "bring the grips together" in service.note
    # A person has led them to where the rope reaches.
    state = step(service, 2 * SECOND, 0.4, start)
    assert (state.refusal, service.note) == ("", "")
    assert service.task.state is RunState.RUNNING
    # Torn apart again under way, the model of the rope stretches, and nothing falls.
    for k in range(3, 6):
        step(service, k * SECOND, 0.6)


def test_run_asks_once_for_another_path_when_the_one_before_it_was_none() -> None:
    service = build(SCENARIO, "session")
    step(service, SECOND, 0.4)
    task = service.task

    def told(now: int, stamp: int, *requests: TaskRequest) -> None:
        refused = messages.Path(
            stamp=stamp,
            goal_revision=task.goal_revision,
            replan_count=task.replan_count,
            reason="no way",
        )
        newest = {topics.CONTROLLER_PATH.key: Received(refused, "planner", 0, now)}
        look(service, now)
        list(service.step(inbox(now, 0.4, newest, *requests), now))

    told(2 * SECOND, SECOND, TaskRequest(id="1", action=TaskRequest.START))
    assert (task.state, task.replan_count) == (RunState.RUNNING, 1)
    told(3 * SECOND, SECOND)
    assert (task.state, str(task.reason)) == (RunState.FAILED, "no way")
    told(4 * SECOND, SECOND, TaskRequest(id="2", action=TaskRequest.START))
    assert task.state is RunState.RUNNING
    # One that was tried while the run waits says how it is now.
    told(5 * SECOND, 5 * SECOND)
    assert task.state is RunState.FAILED


def test_a_run_that_is_over_lasts_no_longer() -> None:
    service = build(SCENARIO, "session")
    said(service, SECOND, 0.4, TaskRequest(id="1", action=TaskRequest.START))
    said(service, 2 * SECOND, 0.4)
    said(service, 3 * SECOND, 0.4, TaskRequest(id="2", action=TaskRequest.STOP))
    published = said(service, 9 * SECOND, 0.4)
    (result,) = (p.message for p in published if p.topic is topics.RUN_RESULT)
    assert result.duration == 2.0
