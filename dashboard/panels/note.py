"""Short text between the elements of a panel."""

from __future__ import annotations

import html


def note_html(text: str) -> str:
    """HTML of a note in small, dim type."""
    return f"<div style='margin:.4em 1em;font-size:.85em;opacity:.8'>{html.escape(text)}</div>"
