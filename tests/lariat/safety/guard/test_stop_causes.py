"""Table of stop causes: shown in the documentation and obeyed by the state machine."""

from __future__ import annotations

from pathlib import Path

import pytest

from lariat.safety.constraints.rule import Rule
from lariat.safety.guard.operator_commands import CommandRejected
from lariat.safety.guard.state_machine import SafetyState
from lariat.safety.guard.stop_causes import STOP_CAUSES, markdown

PAGE = Path(__file__).parents[4] / "docs" / "concepts" / "safety.md"
MOVING = SafetyState("boot-1", "moving", "", "following", session="writer")


def test_page_shows_the_table() -> None:
    text = PAGE.read_text(encoding="utf-8")
    shown = text.partition("<!-- causes -->")[2].partition("<!-- /causes -->")[0].strip()
    assert shown == markdown(), "paste lariat.safety.guard.stop_causes.markdown() between the marks"


def test_page_explains_every_rule() -> None:
    text = PAGE.read_text(encoding="utf-8")
    for rule in Rule.__args__:
        assert f"| `{rule}` |" in text, rule


@pytest.mark.parametrize("cause", [c for c in STOP_CAUSES if STOP_CAUSES[c].stop == "jerk-limited"])
def test_state_machine_resumes_as_the_cause_states(cause: str) -> None:
    if STOP_CAUSES[cause].resumes == "after arming":
        return
    stopped = MOVING.stopped(cause, "for a test")
    resumes = STOP_CAUSES[cause].resumes
    assert stopped.needs_acknowledgement is (resumes == "after acknowledgement")
    assert stopped.needs_approach is (resumes == "after an approach")
    assert stopped.may_move is (resumes == "by itself")
    assert (stopped.moving(True).mode == "moving") is stopped.may_move
    if stopped.needs_acknowledgement:
        assert stopped.acknowledged().resumed().may_move
        with pytest.raises(CommandRejected, match="disarm or acknowledge"):
            stopped.armed()
    else:
        with pytest.raises(CommandRejected, match="nothing to acknowledge"):
            stopped.acknowledged()
