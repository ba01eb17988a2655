"""Conversion of messages of earlier versions, which only recordings hold, to the present one."""

from __future__ import annotations

from google.protobuf.unknown_fields import UnknownFieldSet

from shared.messages import ArmCommand, ArmStates, Message, Parameters
from shared.messages.parameters import fill_typed_fields

ACTION_FIELD_V1 = 5
"""Field of `ArmCommand` that held the action in version 1, in which 0 meant ARM."""
ACTIONS_V1 = (
    ArmCommand.ARM,
    ArmCommand.DISARM,
    ArmCommand.HOLD,
    ArmCommand.ACKNOWLEDGE,
    ArmCommand.GRIPPER,
)
"""Actions by their numbers in version 1."""
MOVABLE_MODES_V1 = (ArmStates.ARMED, ArmStates.MOVING, ArmStates.HOLDING)
"""Modes in which the arms could move in version 1, unless an acknowledgement was missing."""


def upgrade(message: Message, version: int) -> None:
    """Convert a message to the present version, in place.

    Args:
        message: Decoded message.
        version: Version of the message set that it was written with; 0 if not known.
    """
    if isinstance(message, Parameters):
        fill_typed_fields(message)
    elif version < 2 and isinstance(message, ArmCommand):
        _upgrade_command(message)
    elif version < 2 and isinstance(message, ArmStates):
        message.may_move = message.mode in MOVABLE_MODES_V1 and not message.needs_acknowledgement


def _upgrade_command(message: ArmCommand) -> None:
    former = {field.field_number: field.data for field in UnknownFieldSet(message)}
    number = former.get(ACTION_FIELD_V1, 0)
    message.action = ACTIONS_V1[number] if number < len(ACTIONS_V1) else ArmCommand.UNSPECIFIED
    # Its validity was counted from the sender's clock.
    message.answers = message.stamp
    message.DiscardUnknownFields()
