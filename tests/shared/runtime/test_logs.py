from __future__ import annotations

import io
import logging

from shared import topics
from shared.messages import StackState, TaskState, validation
from shared.runtime.logs import LineFormatter, PlainFormatter
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
