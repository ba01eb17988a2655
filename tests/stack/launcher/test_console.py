"""Console of the launcher: lines that a terminal takes, and nothing waits for one that does not."""

from __future__ import annotations

import os
import pty
import termios
from threading import Thread

from stack.launcher.console import ProcessConsole


def print_lines(console: ProcessConsole, count: int) -> bool:
    """Print lines; whether they were printed or left out, and nobody waits."""
    lines = [f"line {k} {'x' * 10_000}" for k in range(count)]
    work = Thread(target=lambda: [console.print_line("sim", t) for t in lines], daemon=True)
    work.start()
    work.join(10.0)
    return not work.is_alive()


def test_launcher_does_not_wait_for_who_reads_no_further() -> None:
    readable, writable = os.pipe()
    with os.fdopen(readable, "rb") as reader, os.fdopen(writable, "w") as stream:
        console = ProcessConsole(stream)
        assert print_lines(console, 100)
        printed = os.read(readable, 1 << 20).count(b"\n")
        assert 10 < printed < 100
        console.print_line("sim", "read again")
        last = reader.readline().decode()
    assert f"sim | read again  ({100 - printed} lines" in last


def test_launcher_does_not_wait_for_a_terminal_that_is_halted() -> None:
    person, terminal = pty.openpty()
    with os.fdopen(terminal, "w") as stream:
        # As by Ctrl-S.
        termios.tcflow(terminal, termios.TCOOFF)
        console = ProcessConsole(stream)
        assert print_lines(console, 10)
        termios.tcflow(terminal, termios.TCOON)
        console.print_line("sim", "goes on")
        text = os.read(person, 1 << 16).decode()
    os.close(person)
    assert "goes on" in text
    assert "10 lines" in text
