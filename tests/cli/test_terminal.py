"""Texts of others on a terminal: no markup, no control characters, whoever prints them."""

from __future__ import annotations

from pathlib import Path

import pytest
from rich.table import Table

import cli
from cli import status
from cli.terminal import Terminal, progress_bar

HOSTILE = "[/x][red]\x1b[2J:smile:"
SHOWN = r"[/x][red]\x1b[2J:smile:"


def test_texts_are_shown_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    terminal = Terminal()
    table = Table(HOSTILE, title=HOSTILE)
    table.add_row(HOSTILE)
    terminal.print(HOSTILE)
    terminal.print(table)
    with progress_bar(terminal) as progress:
        progress.add_task(HOSTILE)
    out = capsys.readouterr().out
    assert out.count(SHOWN) >= 4
    assert "\x1b[2J" not in out


def test_status_shows_names_of_processes_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    row = {"state": HOSTILE, "ok": False, "note": HOSTILE}
    status._print_table({HOSTILE: row})
    out = capsys.readouterr().out
    assert out.count("[/x][red]") == 4
    assert "\x1b[2J" not in out


def test_every_verb_prints_through_it() -> None:
    files = [path for path in Path(cli.__file__).parent.rglob("*.py") if path.stem != "terminal"]
    sinks = ("rich.console", "rich.progress import Progress", "rich.markup", "from rich import")
    assert not [path for path in files if any(sink in path.read_text() for sink in sinks)]
