"""Results of benches: tables on the terminal, one JSON object, or CSV files."""

from __future__ import annotations

import csv
import json as encoder
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, is_dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypeVar

import tyro
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from lariat.configuration import ConfigurationError

REPORT_WIDTH = 200
"""Width of a table that no terminal shows [characters]."""
Row = Mapping[str, Any]
Options = TypeVar("Options")
Flat = Annotated[Options, tyro.conf.arg(name="")]
"""Parameter of a bench whose fields are options of their own, without a prefix."""


class Result(NamedTuple):
    """Table of a bench; its columns are the names of the rows, in the order of their appearance."""

    name: str
    """Name in JSON, of the CSV file, and above the table."""
    rows: Sequence[Any]
    """Dictionaries or dataclasses; a specification `spec` in them is spread out."""
    conditions: str = ""
    """Text below the table: plant, sensing, adaptation, meaning of columns."""


@dataclass(frozen=True)
class PrintOptions:
    """Options of every bench: how results are given."""

    json: bool = False
    """Print one JSON object instead of tables."""
    output: Path | None = None
    """Folder for the tables as CSV."""

    def publish(self, *results: Result, details: Sequence[Result] = ()) -> None:
        """Print tables, or one JSON object that holds the rows of each by its name.

        `details` are for JSON and CSV alone, such as every trial of a campaign.
        """
        everything = {r.name: [_plain(row) for row in r.rows] for r in (*results, *details)}
        if self.output:
            for name, rows in everything.items():
                _write_csv(self.output / f"{name}.csv", rows)
        if self.json:
            print(encoder.dumps(everything))
            return
        console = Console(width=None if sys.stdout.isatty() else REPORT_WIDTH)
        for result in results:
            console.print(_table(result, everything[result.name]))


PRINT_DEFAULTS = PrintOptions()


def _table(result: Result, rows: Sequence[Row]) -> Table:
    table = Table(title=escape(result.name), caption=escape(result.conditions))
    columns = _columns(rows)
    for column in columns:
        words = any(isinstance(row.get(column), str) for row in rows)
        justify = "left" if words else "right"
        table.add_column(escape(column.replace("_", " ")), justify=justify)
    for row in rows:
        table.add_row(*(escape(_cell(row.get(column, ""))) for column in columns))
    return table


def _columns(rows: Sequence[Row]) -> list[str]:
    return list(dict.fromkeys(key for row in rows for key in row))


def _plain(row: Any) -> dict[str, Any]:
    """Row as JSON holds it: specification spread out, None for what is not finite."""
    fields = _fields(row)
    return _finite({**_fields(fields.pop("spec", {})), **fields})


def _fields(row: Any) -> dict[str, Any]:
    fields: Any = asdict(row) if is_dataclass(row) and not isinstance(row, type) else row
    return dict(fields)


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _cell(value: object) -> str:
    """Text of a cell: four digits, lists with commas, yes or no, and a dash for None."""
    match value:
        case list():
            return ", ".join(map(_cell, value)) or "none"
        case None:
            return "–"
        case bool():
            return ("no", "yes")[value]
        case float():
            return f"{value:.4g}"
    return str(value)


def _write_csv(path: Path, rows: Sequence[Row]) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", newline="") as stream:
            writer = csv.DictWriter(stream, _columns(rows), lineterminator="\n")
            writer.writeheader()
            writer.writerows({key: _cell(value) for key, value in row.items()} for row in rows)
    except OSError as error:
        raise ConfigurationError(f"cannot write {path}: {error}") from error
