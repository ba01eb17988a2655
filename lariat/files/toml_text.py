"""Reading of TOML in bounded time and depth.

`tomllib` takes time that grows with the square of a key's depth: 60 kB of `a.a.a…` take 100 s. The
depth is counted before the text is parsed.
"""

from __future__ import annotations

import re
import tomllib
from typing import Any

MAX_TOML_SIZE = 2**20
"""Largest text [characters]."""
MAX_KEY_DEPTH = 8
"""Largest number of parts of a dotted key; a scenario's have up to five."""
MAX_NESTING = 32
"""Largest depth of lists and inline tables in each other."""
_TEXT_OR_COMMENT = re.compile(
    r'"""(?:\\.|[^\\])*?(?:"""|\Z)"{0,2}'
    r"|'''.*?(?:'''|\Z)'{0,2}"
    r'|"(?:\\.|[^"\\\n])*+"?'
    r"|'[^'\n]*+'?"
    r"|#[^\n]*+",
    re.DOTALL,
)
"""Texts and comments, in which brackets and dots mean nothing; one that does not end is an error,
at which the parser stops."""
_KEY_END = re.compile(r"[\n,=\[\]{}]")
_BRACKET = re.compile(r"[\[\]{}]")


def parse_toml(text: str) -> dict[str, Any]:
    """Return the table of a TOML text.

    Raises:
        ValueError: The text is too long or too deep, or no TOML; the text of the error says which.
    """
    if len(text) > MAX_TOML_SIZE:
        raise ValueError(f"{len(text)} characters, more than {MAX_TOML_SIZE}")
    bare = _TEXT_OR_COMMENT.sub("", text)
    depth = 1 + max(part.count(".") for part in _KEY_END.split(bare))
    if depth > MAX_KEY_DEPTH:
        raise ValueError(f"a key has {depth} parts, more than {MAX_KEY_DEPTH}")
    nesting = 0
    for bracket in _BRACKET.findall(bare):
        nesting = max(0, nesting + (1 if bracket in "[{" else -1))
        if nesting > MAX_NESTING:
            raise ValueError(f"lists and tables lie in each other, more than {MAX_NESTING} deep")
    return tomllib.loads(text)
