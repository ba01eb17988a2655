"""Parser of commands and formatter of replies.

command := name "(" [argument {"," argument}] ")"

The protocol has no terminator, so the closing parenthesis ends a command; blanks and line ends
between commands are skipped. The vendor defines no argument with parentheses, but clients send
Python tuples: one level of inner parentheses is kept together, so that such a command gets one
reply.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

NAME_PATTERN = re.compile(r"\s*([A-Za-z_][A-Za-z0-9_]*)\s*\(")
NUMBER_PATTERN = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
COMMAND_LENGTH_LIMIT = 4096
"""Length of an unfinished command above which it is discarded [characters]."""


@dataclass(frozen=True)
class Call:
    """One command, as parsed."""

    text: str
    """The command as received, from its name to the closing parenthesis."""
    name: str
    arguments: tuple[str, ...] = ()
    """Positional arguments."""
    options: dict[str, str] = field(default_factory=dict)
    """Arguments key=value, by key in lower case; the second one of a key is stored as key#2."""


class CommandParser:
    """Parser that splits a stream of bytes into commands."""

    def __init__(self) -> None:
        self._text = ""

    def feed(self, data: bytes) -> list[Call]:
        """Return the commands that the bytes complete; malformed text gives one without a name."""
        self._text += data.decode("utf-8", errors="replace")
        calls = []
        while (end := self._end()) is not None:
            text, self._text = self._text[: end + 1], self._text[end + 1 :]
            calls.append(_call(text.strip()))
        if len(self._text) > COMMAND_LENGTH_LIMIT:
            self._text = ""
        return calls

    def _end(self) -> int | None:
        """Return the index of the parenthesis that closes the first command, outside of quotes."""
        inner, k, before = False, 0, ""
        while k < len(self._text):
            letter = self._text[k]
            if letter == '"':
                # An unclosed quote is skipped: the commands behind it must still be found.
                k = max(self._text.find('"', k + 1), k)
            elif letter == "(":
                # After a comma it opens a tuple; after a name it opens a command.
                inner = inner or before == ","
            elif letter == ")" and inner:
                inner = False
            elif letter == ")":
                return k
            before = before if letter.isspace() else letter
            k += 1
        return None


def _call(text: str) -> Call:
    match = NAME_PATTERN.search(text)
    if match is None:
        return Call(text, "")
    # Other bytes before the name are skipped.
    text = text[match.start() :].lstrip()
    name = match.group(1)
    positional, options = [], {}
    for item in _split(text[text.index("(") + 1 : -1]):
        key, sign, value = item.partition("=")
        if sign and re.fullmatch(r"\s*[A-Za-z_][A-Za-z0-9_]*\s*", key):
            key = key.strip().lower()
            again = sum(k.partition("#")[0] == key for k in options)
            options[f"{key}#{again + 1}" if again else key] = value.strip()
        else:
            positional.append(item.strip())
    return Call(text, name, tuple(positional), options)


def _split(text: str) -> list[str]:
    """Split at commas outside of braces and quotes."""
    items, depth, quoted, start = [], 0, False, 0
    for k, letter in enumerate(text):
        if letter == '"':
            quoted = not quoted
        elif quoted:
            continue
        elif letter in "{[(":
            depth += 1
        elif letter in "}])":
            depth = max(depth - 1, 0)
        elif letter == "," and depth == 0:
            items.append(text[start:k])
            start = k + 1
    items.append(text[start:])
    return [] if len(items) == 1 and not items[0].strip() else items


def parse_number(text: str) -> float | None:
    """Parse a finite number; None when the text is none."""
    # float() alone would accept underscores and non-ASCII digits.
    value = float(text) if NUMBER_PATTERN.fullmatch(text.strip()) else np.inf
    return value if np.isfinite(value) else None


def parse_numbers(text: str) -> tuple[float, ...] | None:
    """Parse numbers within braces; None when the text has another form."""
    if not (text.startswith("{") and text.endswith("}")):
        return None
    values = tuple(parse_number(item) for item in text[1:-1].split(","))
    return None if None in values else values  # pyright: ignore[reportReturnType]


def format_reply(error: int, values: str, call: Call) -> str:
    """Format a reply: ErrorID,{values},echo;"""
    return f"{error},{{{values}}},{call.text};"
