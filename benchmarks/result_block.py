"""Tables of a bench: printed, and written into the page of documentation that names the command.

A page holds a block for each such command:

    <!-- lariat bench goals --scene hard --count 100 -->
    <!-- /lariat -->

The bench that runs with these words and `--docs FOLDER` replaces what stands between the two lines.
"""

from __future__ import annotations

import json as encoder
import re
import shlex
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from lariat.configuration import ConfigurationError
from shared.version import version

REPORT_WIDTH = 200
"""Width of a table that no terminal shows [characters]."""
BLOCK = re.compile(r"^<!-- lariat (bench .+?) -->\n(.*?)^<!-- /lariat -->$", re.M | re.S)
"""Block of a page: the words of its command, and its content."""
BLOCK_TEXT = "<!-- lariat {words} -->\n{content}<!-- /lariat -->"
"""Text of a block."""


@dataclass(frozen=True)
class ResultBlock:
    """Block of a page that a command writes."""

    page: Path
    """Markdown file."""
    words: str
    """Words of the command after `lariat`."""

    def write(self, tables: Sequence[Table]) -> None:
        """Replace the content of the block.

        Raises:
            ConfigurationError: The page cannot be written.
        """
        today = _day(datetime.now(UTC).date())
        origin = f"Written by `lariat {self.words}`, {today}, Lariat {version()}."
        content = "\n".join([*map(markdown, tables), origin, ""])

        def replaced(found: re.Match[str]) -> str:
            if found[1] != self.words:
                return found[0]
            return BLOCK_TEXT.format(words=self.words, content=content)

        try:
            self.page.write_text(BLOCK.sub(replaced, self.page.read_text()))
        except OSError as error:
            raise ConfigurationError(f"cannot write {self.page}: {error}") from error


def find_block(folder: Path | None, words: Sequence[str] | None = None) -> ResultBlock | None:
    """Return the block of a command; None without a folder.

    Args:
        folder: Folder of the pages, `--docs`.
        words: Words of the command after `lariat`; by default those of this process.

    Raises:
        ConfigurationError: No page of the folder has a block for the command.
    """
    if folder is None:
        return None
    command = _without_docs(_process_words() if words is None else words)
    for page in sorted(folder.rglob("*.md")):
        if any(found == command for found, _ in BLOCK.findall(page.read_text())):
            return ResultBlock(page, command)
    lines = BLOCK_TEXT.format(words=command, content="").splitlines()
    raise ConfigurationError(
        f"no page in {folder} has a block for this command; add the lines {' and '.join(lines)}"
    )


def show(tables: Sequence[Table], block: ResultBlock | None, width: int | None = None) -> None:
    """Print tables, and write them into a block if there is one.

    Args:
        tables: Tables of the command.
        block: Block of a page.
        width: Width of the printed tables [characters]; by default that of the terminal.
    """
    console = Console(width=width)
    for table in tables:
        console.print(table)
    if block is not None:
        block.write(tables)
        Console(stderr=True, highlight=False).print(f"wrote {block.page}", markup=False)


def report(
    rows: Sequence[Any],
    caption: str = "",
    *,
    title: str = "",
    json: bool = False,
    block: ResultBlock | None = None,
) -> None:
    """Print dataclasses of one kind as a table, or as one JSON object with a list `rows`.

    Args:
        rows: The dataclasses; their fields are the columns, those of a specification `spec` first.
        caption: Text below the table.
        title: Text above the table.
        json: Whether to print JSON.
        block: Block of a page.
    """
    named = [_flat(asdict(row)) for row in rows]
    if json:
        print(encoder.dumps({"rows": named}))
        return
    cells = [{name: _cell(value) for name, value in row.items()} for row in named]
    width = None if sys.stdout.isatty() else REPORT_WIDTH
    show([numbers_table(title, cells, caption)], block, width)


def figures_table(rows: Sequence[Mapping[str, object]], caption: str) -> Table:
    """Return a table of rows whose names are the columns; floats have two decimals."""
    table = Table(caption=caption)
    for name in rows[0]:
        table.add_column(name.replace("_", " "), justify="right")
    for row in rows:
        table.add_row(*(f"{v:.2f}" if isinstance(v, float) else str(v) for v in row.values()))
    return table


def numbers_table(title: str, rows: Sequence[Mapping[str, object]], caption: str) -> Table:
    """Return a table of rows that may lack columns; floats have four digits."""
    table = Table(title=title, caption=caption)
    columns = list(dict.fromkeys(key for row in rows for key in row))
    for column in columns:
        table.add_column(column.replace("_", " "), justify="right")
    for row in rows:
        values = (row.get(column, "") for column in columns)
        table.add_row(*map(_text, values))
    return table


def _text(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def markdown(table: Table) -> str:
    """Return a table in Markdown: title, columns, rows, caption."""
    heads = [_plain(column.header) for column in table.columns]
    rows = zip(*([_plain(cell) for cell in column.cells] for column in table.columns), strict=True)
    rules = ["---:" if column.justify == "right" else "---" for column in table.columns]
    lines = [f"| {' | '.join(cells)} |" for cells in (heads, rules, *rows)]
    if table.title:
        lines = [f"**{_plain(table.title)}**", "", *lines]
    if table.caption:
        lines += ["", _plain(table.caption)]
    return "\n".join([*lines, ""])


def _flat(row: dict[str, Any]) -> dict[str, Any]:
    return {**row.pop("spec", {}), **row}


def _cell(value: object) -> object:
    """Return a value of a table: lists with commas, yes or no, and a dash for None."""
    if isinstance(value, tuple | list):
        return ", ".join(_text(_cell(each)) for each in value) or "none"
    if value is None:
        return "–"
    return ("no", "yes")[value] if isinstance(value, bool) else value


def _plain(cell: object) -> str:
    """Text of a cell without markup; a bar would end it in Markdown."""
    text = cell.plain if isinstance(cell, Text) else Text.from_markup(str(cell)).plain
    return text.replace("|", "\\|").replace("<", "&lt;")


def _process_words() -> list[str]:
    words = sys.argv[1:]
    return words[words.index("bench") :] if "bench" in words else words


def _without_docs(words: Sequence[str]) -> str:
    """Words without `--docs FOLDER`."""
    kept, skips = [], False
    for word in words:
        if not skips and word != "--docs" and not word.startswith("--docs="):
            kept.append(word)
        skips = word == "--docs"
    return shlex.join(kept)


def _day(day: date) -> str:
    return f"{day.day} {day:%B %Y}"
