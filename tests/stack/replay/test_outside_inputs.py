from __future__ import annotations

from typing import Any

from dashboard.outbox import Outbox
from shared import topics
from shared.messages import ArmCommand, ArmStates, Message, RunListRequest, StackRequest
from shared.recording import Entry
from shared.topics import Topic
from stack.replay import outside_inputs

STATE = ArmStates(boot="boot-7", stamp=9)


def asked_again(outbox: Outbox, topic: Topic, message: Message) -> Any:
    payload = message.SerializeToString()
    entry = Entry(topic.key, message.DESCRIPTOR.full_name, payload, "dashboard-ab", 0, 0)
    outside_inputs._ask_again(outbox, entry)
    (publication,) = outbox.take(0)
    assert publication.topic == topic
    return publication.message


def test_command_and_its_consent_are_asked_again_as_they_were() -> None:
    recorded, again = Outbox("dashboard-ab"), Outbox("dashboard-ab")
    command = recorded.command_arms(
        ArmCommand.APPROACH, STATE, "Approach", approach_distance=0.334, approach_angle=0.1
    )
    recorded.consent(command, STATE)
    for topic, message in list(recorded.take(0)):
        assert asked_again(again, topic, message) == message
    recorded.command_arms(ArmCommand.ACKNOWLEDGE, STATE, "Acknowledge", session="controller-1")
    ((_, message),) = recorded.take(0)
    assert asked_again(again, topics.ARM_COMMAND, message) == message


def test_requests_about_runs_and_scenarios_are_asked_again_as_they_were() -> None:
    recorded, again = Outbox("dashboard-ab"), Outbox("dashboard-ab")
    recorded.request_runs(RunListRequest.SEND_PICTURE, ["run-1"], "", time=1.5)
    recorded.request_runs(RunListRequest.ANNOTATE, ["run-1"], "Note", note="stiff", star=True)
    settings = ["control.clearance=0.02"]
    recorded.request_stack(StackRequest.SAVE, "Save", settings=settings, name="mine")
    recorded.request_stack(StackRequest.START, "Start", content=b"a", confirmed=["10.0.0.6"])
    for topic, message in list(recorded.take(0)):
        assert asked_again(again, topic, message) == message
