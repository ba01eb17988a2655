"""Commands and replies as text.

command := name "(" [argument {"," argument}] ")"; no terminator is promised, so the closing
parenthesis frames it; blanks and line ends between commands are skipped. No argument of the maker's
has parentheses, but Python's tuples have, and people send them: one level of them is kept together,
so that such a command gets one answer.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

NAME = re.compile(r"\s*([A-Za-z_][A-Za-z0-9_]*)\s*\(")
NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
LONGEST = 4096
"""Bytes without a closing parenthesis after which what came is thrown away."""


@dataclass(frozen=True)
class Call:
    """One command."""

    text: str
    """As it was received, from its name to the closing parenthesis."""
    name: str
    arguments: tuple[str, ...] = ()
    """Positional."""
    options: dict[str, str] = field(default_factory=dict)
    """By key, in lower case; the second of one key is called key#2."""


class CommandReader:
    """Cuts a stream of bytes into commands."""

    def __init__(self) -> None:
        self._text = ""

    def feed(self, data: bytes) -> list[Call]:
        """The commands that the bytes complete; what is no command becomes one without a name."""
        self._text += data.decode("utf-8", errors="replace")
        calls = []
        while (end := self._end()) is not None:
            text, self._text = self._text[: end + 1], self._text[end + 1 :]
            calls.append(_call(text.strip()))
        if len(self._text) > LONGEST:
            self._text = ""
        return calls

    def _end(self) -> int | None:
        """Where the first command closes; a parenthesis within quotes does not count."""
        inner, k, before = False, 0, ""
        while k < len(self._text):
            letter = self._text[k]
            if letter == '"':
                # A quote that nobody closes is rubbish, and must not swallow what comes behind it.
                k = max(self._text.find('"', k + 1), k)
            elif letter == "(":
                # Behind a comma it opens a tuple; behind a name a command begins.
                inner = inner or before == ","
            elif letter == ")" and inner:
                inner = False
            elif letter == ")":
                return k
            before = before if letter.isspace() else letter
            k += 1
        return None


def _call(text: str) -> Call:
    match = NAME.search(text)
    if match is None:
        return Call(text, "")
    # Rubbish before a name does not keep the command from being found.
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
    """Arguments between commas that stand in no braces or quotes.

    What follows a closing brace without a comma is an argument of its own, as the maker says.
    """
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
            if letter == "}" and depth == 0 and text[k + 1 :].lstrip()[:1] not in ("", ","):
                items.append(text[start : k + 1])
                start = k + 1
        elif letter == "," and depth == 0:
            items.append(text[start:k])
            start = k + 1
    items.append(text[start:])
    return [] if len(items) == 1 and not items[0].strip() else items


def number(text: str) -> float | None:
    """A finite number, or None."""
    # Python would read underscores and other alphabets' digits as well.
    value = float(text) if NUMBER.fullmatch(text.strip()) else np.inf
    return value if np.isfinite(value) else None


def numbers(text: str) -> tuple[float, ...] | None:
    """The numbers within braces, or None."""
    if not (text.startswith("{") and text.endswith("}")):
        return None
    values = tuple(number(item) for item in text[1:-1].split(","))
    return None if None in values else values  # pyright: ignore[reportReturnType]


def reply(error: int, values: str, call: Call) -> str:
    """ErrorID,{values},echo;"""
    return f"{error},{{{values}}},{call.text};"
