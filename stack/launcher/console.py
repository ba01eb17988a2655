"""Console output of several processes in one terminal.

Nobody waits for the terminal: lines that it does not take, since it is halted (Ctrl-S) or a pager
reads no further, are left out and counted.
"""

from __future__ import annotations

import logging
import select
import sys
from contextlib import suppress
from typing import TextIO

from lariat.plain_text import plain_text

_NAME_COLORS = (36, 33, 32, 35, 34, 96, 93, 92, 95, 94)
_LEVEL_COLORS = {"error": 31, "warning": 33}
MAX_LINE_SIZE = 4000
"""Size after which a line is cut [bytes]: a pipe that takes anything takes 4096 bytes at once."""


class ProcessConsole:
    """Printer of lines, each after the name of its process; in colour on a terminal."""

    def __init__(self, stream: TextIO = sys.stderr, width: int = 13) -> None:
        self._stream = stream
        self._width = width
        self._colored = stream.isatty()
        self._colors: dict[str, int] = {}
        self._left_out = 0
        """Number of lines that the terminal has not taken."""

    def print_line(self, name: str, text: str, level: str = "") -> None:
        """Print a line of a process, coloured if its level or first word is error or warning."""
        text = plain_text(text)
        level = level or text.partition(":")[0]
        color = _LEVEL_COLORS.get(level)
        line = f"{name:>{self._width}} | {text}"
        if self._colored:
            own = self._colors.setdefault(name, _NAME_COLORS[len(self._colors) % len(_NAME_COLORS)])
            text = f"\x1b[{color}m{text}\x1b[0m" if color else text
            line = f"\x1b[{own}m{name:>{self._width}} |\x1b[0m {text}"
        # The terminal may have been closed; what runs is ended in order all the same.
        with suppress(OSError):
            if not self._is_writable():
                self._left_out += 1
                return
            if self._left_out:
                line += f"  ({self._left_out} lines before were left out: nobody read them)"
                self._left_out = 0
            content = line.encode(errors="replace")[:MAX_LINE_SIZE]
            print(content.decode(errors="ignore"), file=self._stream, flush=True)

    def _is_writable(self) -> bool:
        """Whether a line can be written at once."""
        try:
            number = self._stream.fileno()
        except OSError:
            return True  # Text in memory.
        poll = select.poll()
        poll.register(number, select.POLLOUT)
        return bool(poll.poll(0))


class ConsoleHandler(logging.Handler):
    """Logging handler that prints the launcher's own log records among the processes' lines."""

    def __init__(self, console: ProcessConsole) -> None:
        super().__init__(logging.INFO)
        self._console = console

    def emit(self, record: logging.LogRecord) -> None:
        """Print one record."""
        level = "" if record.levelno == logging.INFO else record.levelname.lower()
        self._console.print_line("lariat", self.format(record), level)
