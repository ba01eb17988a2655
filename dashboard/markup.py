"""HTML of texts that come from files, messages and persons."""

from __future__ import annotations

import html
import re
from collections.abc import Iterable

from lariat.plain_text import plain_text


def escaped(text: str) -> str:
    """HTML that shows a text as it is; every text that enters HTML passes here."""
    return html.escape(plain_text(text))


def text_html(text: str) -> str:
    """HTML of a text in which `code` stands between backticks."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", escaped(text))


def note_html(text: str) -> str:
    """HTML of a note in small, dim type."""
    return f"<div style='margin:.4em 1em;font-size:.85em;opacity:.8'>{text_html(text)}</div>"


def paragraph_html(text: str, weight: int = 400) -> str:
    """HTML of a paragraph in a dialog, in a CSS weight."""
    style = f"margin:.4em 1em;font-weight:{weight};overflow-wrap:anywhere"
    return f"<div style='{style}'>{text_html(text)}</div>"


def table_html(heads: Iterable[str], rows_html: str, height: str = "none") -> str:
    """HTML of a table in small type: rows below named columns; it scrolls above a height."""
    head = "".join(
        f"<th style='text-align:left;font-weight:500;opacity:.6'>{escaped(h)}</th>" for h in heads
    )
    return (
        f"<div style='margin:.4em .6em;max-height:{height};overflow:auto'><table style='"
        "font-size:.78em;border-spacing:.5em .25em;line-height:1.25;"
        f"font-variant-numeric:tabular-nums'><tr>{head}</tr>{rows_html}</table></div>"
    )
