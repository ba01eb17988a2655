"""Check of messages: what is refused is counted, and said briefly."""

from __future__ import annotations

import pytest

from shared.bus.message_check import MessageCheck, RawMessage
from shared.door import MAX_LOGGED_LENGTH
from shared.messages import ArmState, ArmStates
from shared.topics import ARM_STATE
from shared.version import MESSAGE_VERSION


def test_refusal_quotes_no_more_than_the_beginning_of_a_message(
    caplog: pytest.LogCaptureFixture,
) -> None:
    states = ArmStates(mode=ArmStates.ARMED, arms=[ArmState(arm="x" * 5000), ArmState(arm="left")])
    payload, kind = states.SerializeToString(), ArmStates.DESCRIPTOR.full_name
    check = MessageCheck()
    raw = RawMessage(ARM_STATE.key, kind, payload, "stranger", 0, 0, MESSAGE_VERSION)
    assert check.decode(ARM_STATE, raw) is None
    assert check.door.refused == 1
    assert all(w in caplog.text for w in ("refused arm/state from stranger", "['xxx"))
    assert len(caplog.records[0].getMessage()) < MAX_LOGGED_LENGTH + 100
