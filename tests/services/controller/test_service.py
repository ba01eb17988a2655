"""The controller with arms that stand anywhere."""

from __future__ import annotations

from pathlib import Path

from services.controller.service import ControllerService, build
from shared import topics
from shared.messages import ArmState, ArmStates, TaskRequest, TaskState
from shared.scenario import load
from shared.service import SECOND, Inbox, Received

SCENARIO = load(Path(__file__).parents[3] / "scenarios" / "three-cylinders.toml")
LEVEL = [0.5, 0.5, 0.5, 0.5]


def arms(now: int, apart: float) -> ArmStates:
    sides = (("left", -0.2), ("right", apart - 0.2))
    places = [
        ArmState(arm=side, driver="ideal", position=[x, 0.0, 0.3], orientation=LEVEL)
        for side, x in sides
    ]
    return ArmStates(stamp=now, mode=ArmStates.ARMED, arms=places)


def step(service: ControllerService, now: int, apart: float, *requests: TaskRequest) -> TaskState:
    """The task's state a second after the one before."""

    def item(topic: topics.Topic, message: object) -> tuple[str, list[Received]]:
        return topic.key, [Received(message, "somebody", 0, now)]

    rows = [item(topics.ARM_STATE, arms(now, apart))]
    rows += [item(topics.TASK_REQUEST, request) for request in requests]
    said = list(service.step(Inbox({}, dict(rows)), now))
    (state,) = (p.message for p in said if p.topic is topics.TASK_STATE)
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
    assert service.task.state == "running"
    # Torn apart again under way, the model of the rope stretches, and nothing falls.
    for k in range(3, 6):
        step(service, k * SECOND, 0.6)
