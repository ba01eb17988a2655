from __future__ import annotations

import pytest

from lariat.safety.guard.operator_commands import (
    Action,
    CommandRejected,
    OperatorCommand,
    check_command,
)
from lariat.trajectory import SECOND

NOW = 2 * SECOND


@pytest.mark.parametrize(
    ("boot", "answers", "changed", "words"),
    [
        ("boot-1", SECOND, 0, ""),
        ("boot-1", SECOND - 1, 0, "1.000 s old"),
        ("boot-1", NOW + 1, 0, "old"),
        ("boot-0", NOW, 0, "check the state again"),
        ("boot-1", SECOND, SECOND, ""),
        ("boot-1", SECOND, SECOND + 1, "has changed"),
    ],
    ids=["boundary", "late", "of a state to come", "other start", "seen", "outdated"],
)
def test_command_counts_as_answer_to_a_recent_state_that_still_holds(
    boot: str, answers: int, changed: int, words: str
) -> None:
    command = OperatorCommand("id", boot, answers, "acknowledge")
    if not words:
        check_command(command, "boot-1", NOW, changed)
        return
    with pytest.raises(CommandRejected, match=words):
        check_command(command, "boot-1", NOW, changed)


@pytest.mark.parametrize("action", ["hold", "disarm"])
def test_stop_is_obeyed_whatever_boot_it_names_and_whatever_state_it_answers(
    action: Action,
) -> None:
    check_command(OperatorCommand("id", "boot-of-yesterday", -1, action), "boot-1", NOW, NOW)
