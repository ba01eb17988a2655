from __future__ import annotations

import io
import logging

from shared import topics
from shared.messages import StackState, TaskState, validation
from shared.runtime.logs import (
    FOLDING_PERIOD,
    MAX_REPETITIONS,
    LineFormatter,
    PlainFormatter,
    RepetitionFilter,
)
from stack.launcher.console import ProcessConsole

HOSTILE = "\x1b[2J\x9b31mall is well\r"
PLAIN = r"\x1b[2J\x9b31mall is well\r"


def test_log_shows_control_characters_of_messages_and_exceptions_as_escapes() -> None:
    try:
        raise ValueError(HOSTILE)
    except ValueError as error:
        fault = (ValueError, error, error.__traceback__)
    record = logging.LogRecord("a", logging.WARNING, "a.py", 1, "%s", (HOSTILE,), fault)
    for formatter in (PlainFormatter(), LineFormatter()):
        text = formatter.format(record)
        assert text.count(PLAIN) == 2
        assert "\x1b" not in text
        assert "\n" in text, "a traceback keeps its lines"


def test_terminal_shows_control_characters_of_processes_as_escapes() -> None:
    terminal = io.StringIO()
    ProcessConsole(terminal).print_line("sim", HOSTILE)
    assert terminal.getvalue().endswith(f"| {PLAIN}\n")


def test_texts_of_messages_have_no_control_characters() -> None:
    task = TaskState(reason=HOSTILE)
    assert validation.decode(topics.TASK_STATE, task.SerializeToString()).reason == PLAIN
    stack = StackState(scenario="a")
    stack.scenarios.add(name="b", real_arms=["c", HOSTILE])
    decoded = validation.decode(topics.STACK_STATE, stack.SerializeToString())
    assert list(decoded.scenarios[0].real_arms) == ["c", PLAIN]


def passed(texts: list[tuple[float, str, str]]) -> list[str]:
    """Texts that a filter passes, of those at a time [s] with a fold."""
    repetitions, found = RepetitionFilter(), []
    for created, text, fold in texts:
        record = logging.LogRecord("a", logging.WARNING, "a.py", 1, "%s", (text,), None)
        record.created, record.fold = created, fold
        if repetitions.filter(record):
            found.append(record.getMessage())
    return found


def test_what_is_repeated_is_folded_and_counted() -> None:
    many = [(float(k), f"late by {k} ms", "") for k in range(50)]
    late = passed([*many, (FOLDING_PERIOD + 1.0, "late by 7 ms", "")])
    assert len(late) == MAX_REPETITIONS + 1
    assert "47" in late[-1]
    assert len(passed([*many, (60.0 + 1.0, "late by 7 s", "")])) == MAX_REPETITIONS + 1


def test_other_texts_pass_between_repetitions() -> None:
    texts = [(0.1 * k, "alarm" if k == 30 else "late", "") for k in range(60)]
    assert passed(texts) == ["late"] * MAX_REPETITIONS + ["alarm"]


def test_texts_of_one_fold_count_together() -> None:
    places = [(0.1 * k, f"stuck in {'abcdefgh'[k % 8]}", "stuck") for k in range(40)]
    assert len(passed(places)) == MAX_REPETITIONS
