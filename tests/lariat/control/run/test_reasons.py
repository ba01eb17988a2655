"""Reasons have a text each, and those of the task's state a code on the bus."""

from __future__ import annotations

from lariat.control.run.reasons import TEXTS, Reason, ReasonCode
from shared.messages import TaskState


def test_every_reason_has_a_text() -> None:
    assert set(TEXTS) == set(ReasonCode)


def test_every_code_on_the_bus_is_a_reason() -> None:
    codes = set(TaskState.Reason.keys()) - {"UNSPECIFIED"}
    assert codes <= {code.name for code in ReasonCode}


def test_text_holds_the_detail() -> None:
    refused = Reason(ReasonCode.SETPOINTS_REFUSED, {"refusal": "joint_limits {x}"})
    failed = Reason(ReasonCode.PATH_NOT_FOLLOWED, {"cause": refused, "paths": 3, "margin_mm": 9.0})
    assert all(word in str(failed) for word in ("joint_limits {x}", "3 new paths", "9 mm"))
