"""Terminal that shows texts of files and of other processes as they are."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.text import Text

from lariat.plain_text import plain_text


class Terminal(Console):
    """Console without markup, emoji codes and control characters: any text may be printed."""

    def __init__(self, stderr: bool = False) -> None:
        super().__init__(stderr=stderr, highlight=False, markup=False, emoji=False)

    def render_str(self, text: str, **options: Any) -> Text:
        """Return a text for the terminal, of a print or of a table's cell."""
        return super().render_str(plain_text(text), **options)


def progress_bar(terminal: Terminal) -> Progress:
    """Return a bar that vanishes at its end."""
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    return Progress(
        *columns, console=terminal, transient=True, redirect_stdout=False, redirect_stderr=False
    )
