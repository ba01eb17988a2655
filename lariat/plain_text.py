"""Texts of others without control characters.

A control or escape sequence can clear a terminal, overwrite lines of a log or turn the direction of
what is read.
"""

from __future__ import annotations

import re

_CONTROL = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)
"""Control characters but tab and newline, separators of lines, marks of direction, surrogates."""


def is_plain(text: str) -> bool:
    """Return whether a text has no control characters but tabs and newlines."""
    return _CONTROL.search(text) is None


def plain_text(text: str) -> str:
    r"""Return a text with its control characters but tabs and newlines as escapes, e.g. `\x1b`."""
    return _CONTROL.sub(lambda match: ascii(match[0])[1:-1], text)
