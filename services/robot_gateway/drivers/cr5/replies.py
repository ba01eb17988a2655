"""Replies of the CR5: ErrorID,{values},echo; torn, joined, late or outside the grammar."""

from __future__ import annotations

import re
from dataclasses import dataclass

NOT_TCP = re.compile(rb"control mode is not tcp|not tcp mode", re.IGNORECASE)
# Nobody's error code is longer, and Python refuses to read numbers without end.
HEAD = re.compile(r"(-?\d{1,9})\s*,\s*\{")
LONGEST = 65536

ERRORS = {
    -1: "failed",
    -2: "the arm is in alarm",
    -3: "the emergency stop is pressed",
    -4: "the arm has no power",
    -5: "a script runs",
    -6: "the axis does not fit the frame",
    -7: "a script is paused",
    -8: "the authorisation has expired",
    -9: "this command is switched off on the arm",
    -10000: "no such command on this firmware",
    -20000: "wrong number of arguments",
}
"""Of the first field, in words."""


@dataclass(frozen=True)
class Reply:
    """One answer."""

    error: int
    values: str
    """Between the outer braces."""
    echo: str
    """The command as the arm read it."""

    @property
    def words(self) -> str:
        """What the error code means."""
        if self.error in ERRORS:
            return ERRORS[self.error]
        kinds = {3: "type of argument", 4: "range of argument", 5: "type of option"}
        kind = kinds.get(-self.error // 10000, "range of option")
        return f"{kind} {-self.error % 10000} is wrong"

    def answers(self, command: str) -> bool:
        """Whether it is the answer to a command that was sent."""
        return _bare(command) == _bare(self.echo)


class ReplyReader:
    """Cuts a stream of bytes into replies."""

    def __init__(self) -> None:
        self._buffer = b""
        self.not_tcp = False
        """Whether the arm said that TCP control is off; the reader of it sets it back."""

    def feed(self, data: bytes) -> list[Reply]:
        """The replies that the bytes complete; what is no reply is skipped."""
        self._buffer += data
        if NOT_TCP.search(self._buffer):
            self.not_tcp = True
            self._buffer = NOT_TCP.sub(b"", self._buffer)
        *whole, self._buffer = self._buffer.split(b";")
        self._buffer = self._buffer[-LONGEST:]
        texts = (part.decode("utf-8", errors="replace") for part in whole)
        return [reply for reply in map(_reply, texts) if reply is not None]


def integers(text: str) -> list[int]:
    """All whole numbers in a text, whatever brackets stand round them."""
    return [int(n) for n in re.findall(r"-?\d{1,9}", text)]


def _reply(text: str) -> Reply | None:
    head = HEAD.search(text)
    if head is None:
        return None
    depth, start = 1, head.end()
    for k in range(start, len(text)):
        depth += {"{": 1, "}": -1}.get(text[k], 0)
        if depth == 0:
            echo = text[k + 1 :].strip().lstrip(",").strip()
            return Reply(int(head.group(1)), text[start:k].strip(), echo)
    return None


def _bare(command: str) -> str:
    return re.sub(r"\s", "", command).lower()
