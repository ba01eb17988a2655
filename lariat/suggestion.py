"""Suggestion of the word that was probably meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path


def did_you_mean(word: str, words: Iterable[str]) -> str:
    """Return ` did you mean 'WORD'?` for the known word most like a given one, or nothing."""
    names = list(words)
    close = difflib.get_close_matches(word, names, n=1)
    # A word that was cut short is further from its whole than a typing error.
    close = close or [name for name in names if word and name.startswith(word)][:1]
    return f" did you mean {close[0]!r}?" if close else ""


def did_you_mean_file(path: Path) -> str:
    """Return ` did you mean 'PATH'?` for the file beside a missing one with the most like name."""
    names = []
    with suppress(OSError):
        names = sorted(each.name for each in path.parent.iterdir())
    words = did_you_mean(path.name, names)
    return words.replace("'", f"'{path.parent}/", 1) if path.parent != Path() and words else words
