"""Short text between the elements of a panel."""

from __future__ import annotations

import html
import re


def text_html(text: str) -> str:
    """HTML of a text in which `code` stands between backticks."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(text))


def note_html(text: str) -> str:
    """HTML of a note in small, dim type."""
    return f"<div style='margin:.4em 1em;font-size:.85em;opacity:.8'>{text_html(text)}</div>"
