"""Console output of several processes in one terminal."""

from __future__ import annotations

import logging
import sys
from contextlib import suppress
from typing import TextIO

from lariat.plain_text import plain_text

_NAME_COLORS = (36, 33, 32, 35, 34, 96, 93, 92, 95, 94)
_LEVEL_COLORS = {"error": 31, "warning": 33}


class ProcessConsole:
    """Printer of lines, each after the name of its process; in colour on a terminal."""

    def __init__(self, stream: TextIO = sys.stderr, width: int = 13) -> None:
        self._stream = stream
        self._width = width
        self._colored = stream.isatty()
        self._colors: dict[str, int] = {}

    def print_line(self, name: str, text: str, level: str = "") -> None:
        """Print one line.

        Args:
            name: Name of the process.
            text: The line.
            level: "error" or "warning", which are coloured; by default the word before the line's
                first colon.
        """
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
            print(line, file=self._stream, flush=True)


class ConsoleHandler(logging.Handler):
    """Logging handler that prints the launcher's own log records among the processes' lines."""

    def __init__(self, console: ProcessConsole) -> None:
        super().__init__(logging.INFO)
        self._console = console

    def emit(self, record: logging.LogRecord) -> None:
        """Print one record."""
        level = "" if record.levelno == logging.INFO else record.levelname.lower()
        self._console.print_line("lariat", self.format(record), level)
