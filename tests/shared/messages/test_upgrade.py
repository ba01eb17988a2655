"""Commands and states of the arms in recordings of version 1."""

from __future__ import annotations

import pytest

from shared import topics
from shared.messages import ArmCommand, ArmStates
from shared.recording import Entry

STAMP, ID = b"\x10\x05", b"\x0a\x01a"
"""Fields `stamp` = 5 and `id` = "a" as they are written."""


def entry(topic: topics.Topic, payload: bytes, version: int) -> Entry:
    name = topic.type.DESCRIPTOR.full_name
    return Entry(topic.key, name, payload, "lariat", 0, 5, version)


@pytest.mark.parametrize(
    ("action", "payload"),
    [
        (ArmCommand.ARM, b""),
        (ArmCommand.DISARM, b"\x28\x01"),
        (ArmCommand.HOLD, b"\x28\x02"),
        (ArmCommand.ACKNOWLEDGE, b"\x28\x03"),
        (ArmCommand.GRIPPER, b"\x28\x04"),
        (ArmCommand.UNSPECIFIED, b"\x28\x4d"),
    ],
)
def test_action_of_version_1_is_read_from_its_field(
    action: ArmCommand.Action, payload: bytes
) -> None:
    command = entry(topics.ARM_COMMAND, ID + STAMP + payload, 1).parse()
    assert (command.action, command.id, command.answers) == (action, "a", 5)


def test_empty_command_of_the_present_version_names_no_action() -> None:
    assert entry(topics.ARM_COMMAND, ID, 2).parse().action == ArmCommand.UNSPECIFIED


@pytest.mark.parametrize(
    ("mode", "waits", "moves"),
    [
        (ArmStates.HOLDING, True, False),
        (ArmStates.HOLDING, False, True),
        (ArmStates.ARMED, False, True),
        (ArmStates.DISARMED, False, False),
    ],
)
def test_state_of_version_1_says_whether_its_arms_could_move(
    mode: ArmStates.Mode, waits: bool, moves: bool
) -> None:
    payload = ArmStates(mode=mode, needs_acknowledgement=waits).SerializeToString()
    assert entry(topics.ARM_STATE, payload, 1).parse().may_move is moves
