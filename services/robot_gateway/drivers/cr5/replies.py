"""Parser of the CR5's replies, `ErrorID,{values},echo;`, in a stream that may be torn or joined."""

from __future__ import annotations

import re
from dataclasses import dataclass

NOT_TCP_TEXT = re.compile(rb"control mode is not tcp|not tcp mode", re.IGNORECASE)
"""Plain text that the arm sends when TCP control is off."""
REPLY_START = re.compile(r"(-?\d{1,9})\s*,\s*\{")
"""Error code and opening brace; the length is bounded because int() refuses very long numbers."""
REPLY_SIZE_LIMIT = 65536
"""Largest unfinished reply that is kept [bytes]."""

ERROR_TEXTS = {
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
"""Meaning of the error codes."""


@dataclass(frozen=True)
class Reply:
    """One reply."""

    error: int
    """Error code; 0 for success."""
    values: str
    """Text between the outer braces."""
    echo: str
    """The command as the arm understood it."""

    @property
    def words(self) -> str:
        """Meaning of the error code."""
        if self.error in ERROR_TEXTS:
            return ERROR_TEXTS[self.error]
        kinds = {3: "type of argument", 4: "range of argument", 5: "type of option"}
        kind = kinds.get(-self.error // 10000, "range of option")
        return f"{kind} {-self.error % 10000} is wrong"

    def answers(self, command: str) -> bool:
        """Whether this is the reply to a command."""
        return _normalized(command) == _normalized(self.echo)


class ReplyReader:
    """Splits a stream of bytes into replies."""

    def __init__(self) -> None:
        self._buffer = b""
        self.not_tcp = False
        """Whether the arm has reported that TCP control is off; reset by the caller."""

    def feed(self, data: bytes) -> list[Reply]:
        """Return the replies that the bytes complete; other text is skipped."""
        if not data:
            return []
        self._buffer += data
        if NOT_TCP_TEXT.search(self._buffer):
            self.not_tcp = True
            self._buffer = NOT_TCP_TEXT.sub(b"", self._buffer)
        *complete, self._buffer = self._buffer.split(b";")
        self._buffer = self._buffer[-REPLY_SIZE_LIMIT:]
        texts = (part.decode("utf-8", errors="replace") for part in complete)
        return [reply for reply in map(_parse_reply, texts) if reply is not None]


def integers(text: str) -> list[int]:
    """Return all integers in a text, with any brackets around them."""
    return [int(n) for n in re.findall(r"-?\d{1,9}", text)]


def _parse_reply(text: str) -> Reply | None:
    head = REPLY_START.search(text)
    if head is None:
        return None
    depth, start = 1, head.end()
    for k in range(start, len(text)):
        depth += {"{": 1, "}": -1}.get(text[k], 0)
        if depth == 0:
            echo = text[k + 1 :].strip().lstrip(",").strip()
            return Reply(int(head.group(1)), text[start:k].strip(), echo)
    return None


def _normalized(command: str) -> str:
    return re.sub(r"\s", "", command).lower()
