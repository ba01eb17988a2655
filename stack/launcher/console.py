"""Lines of several processes in one terminal."""

from __future__ import annotations

import logging
import sys
from typing import TextIO

_NAME_COLORS = (36, 33, 32, 35, 34, 96, 93, 92, 95, 94)
_LEVEL_COLORS = {"error": 31, "warning": 33}


class Lines:
    """Prints lines with the name of who said them in front, in colour on a terminal."""

    def __init__(self, stream: TextIO = sys.stderr, width: int = 13) -> None:
        self._stream = stream
        self._width = width
        self._colored = stream.isatty()
        self._colors: dict[str, int] = {}

    def say(self, name: str, text: str, level: str = "") -> None:
        """Prints one line; a line that begins with a level in words has that level."""
        level = level or text.partition(":")[0]
        color = _LEVEL_COLORS.get(level)
        if not self._colored:
            print(f"{name:>{self._width}} | {text}", file=self._stream, flush=True)
            return
        own = self._colors.setdefault(name, _NAME_COLORS[len(self._colors) % len(_NAME_COLORS)])
        text = f"\x1b[{color}m{text}\x1b[0m" if color else text
        print(f"\x1b[{own}m{name:>{self._width}} |\x1b[0m {text}", file=self._stream, flush=True)


class LineHandler(logging.Handler):
    """Prints what the launcher's own process logs among the other lines."""

    def __init__(self, lines: Lines) -> None:
        super().__init__(logging.INFO)
        self._lines = lines

    def emit(self, record: logging.LogRecord) -> None:
        level = "" if record.levelno == logging.INFO else record.levelname.lower()
        self._lines.say("lariat", self.format(record), level)
