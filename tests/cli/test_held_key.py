"""A key that a person holds down, at a terminal of the test's own."""

from __future__ import annotations

import os
import time
import tty
from collections.abc import Iterator

import pytest

from cli import __main__ as lariat
from cli.held_key import REPEAT_PERIOD, HeldKey

pytestmark = pytest.mark.live


@pytest.fixture
def terminal() -> Iterator[tuple[int, int]]:
    """Ends of a terminal: the person's keyboard and the program's input."""
    keyboard, program = os.openpty()
    tty.setcbreak(program)
    try:
        yield keyboard, program
    finally:
        os.close(keyboard)
        os.close(program)


def test_key_is_held_from_its_press_until_its_repetitions_end(terminal: tuple[int, int]) -> None:
    keyboard, program = terminal
    held = HeldKey(program)
    assert not held()
    os.write(keyboard, b" ")
    held.wait()
    # Before a terminal repeats a key it waits longer than between repetitions.
    time.sleep(2.0 * REPEAT_PERIOD)
    assert held()
    for _ in range(3):
        os.write(keyboard, b" ")
        time.sleep(0.02)
        assert held()
    time.sleep(1.5 * REPEAT_PERIOD)
    assert not held()
    # Pressed again, it begins like the first time.
    os.write(keyboard, b" ")
    held.wait()
    time.sleep(2.0 * REPEAT_PERIOD)
    assert held()


def test_approach_needs_a_terminal(capfd: pytest.CaptureFixture[str]) -> None:
    assert lariat.main(["approach", "334"]) == 1
    assert "a terminal" in capfd.readouterr().err
