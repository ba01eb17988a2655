"""Tables of numbers as spreadsheets and other programs write them.

Cells are separated by commas, semicolons or white space; where a comma does not separate cells, it
is the decimal point. Text is UTF-8 or UTF-16 with or without a byte order mark, or
Windows-1252. What follows a # is skipped; the first row may name the columns.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

MAX_QUOTED_LENGTH = 60
"""Largest number of characters of a row that an error quotes."""
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f]")
_SEPARATOR_NOTE = re.compile(r"sep=.", re.IGNORECASE)
"""Line in which Excel names the separator."""
_QUOTED = re.compile(r'"([^"]*)"')
_UNIT = re.compile(r"\s*[\[(].*")
_NUMBER = r"[-+]?\d+(?:,\d+)?(?:[eE][-+]?\d+)?"
_NUMERIC = re.compile(r"[-+.]?\d")
_DECIMAL_COMMAS = re.compile(rf"{_NUMBER}(?:\s+{_NUMBER})+")


@dataclass(frozen=True)
class Table:
    """Rows of numbers."""

    values: Float64[np.ndarray, "n k"]
    """Numbers; NaN for an empty cell."""
    names: tuple[str, ...]
    """Names of the columns in the header row; empty where there is none."""
    lines: tuple[int, ...]
    """Number of each row's line in the text, from 1."""

    def columns(self, *names: str) -> Float64[np.ndarray, "n m"]:
        """Return columns by their names, else by their order.

        A header row finds them in any order, without regard to case and units (`X [m]`). Without
        one that names them all, the table has just these columns, or an index before them.

        Raises:
            ValueError: The table has other columns; the text says how many.
        """
        own = [_UNIT.sub("", name).lower() for name in self.names]
        if all(own.count(name.lower()) == 1 for name in names):
            return self.values[:, [own.index(name.lower()) for name in names]]
        values = self.values
        if values.shape[1] == len(names) + 1 and _is_index(values[:, 0]):
            values = values[:, 1:]
        if values.shape[1] != len(names):
            count = self.values.shape[1]
            raise ValueError(f"line {self.lines[0]}: {count} numbers instead of {', '.join(names)}")
        return values


def decode_text(content: bytes) -> str:
    """Return the text of a file, without a byte order mark.

    Raises:
        ValueError: It is no text.
    """
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        encodings = ["utf-16"]
    elif content[1:2] == b"\0":
        encodings = ["utf-16-le"]
    else:
        encodings = ["utf-8-sig", "cp1252"]
    for encoding in encodings:
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        if not _CONTROL.search(text):
            return text
    raise ValueError("it is no text")


def read_table(content: bytes) -> Table:
    """Return the table of a file.

    Raises:
        ValueError: There is no row, or one is not of numbers, or of another count than the first;
            the text names it.
    """
    names: tuple[str, ...] = ()
    rows: list[list[float]] = []
    lines: list[int] = []
    for number, line in enumerate(decode_text(content).splitlines(), start=1):
        text = line.partition("#")[0].strip()
        if not text or _SEPARATOR_NOTE.fullmatch(text):
            continue
        cells = [cell.strip(" \"'") for cell in _split(text)]
        try:
            row = [float(cell) if cell else np.nan for cell in cells]
        except ValueError:
            if not rows and not names and not any(_NUMERIC.match(cell) for cell in cells):
                names = tuple(cells)
                continue
            quoted = text[:MAX_QUOTED_LENGTH]
            raise ValueError(f"line {number}: {quoted!r} is not a row of numbers") from None
        if rows and len(row) != len(rows[0]):
            raise ValueError(
                f"line {number}: {len(row)} numbers, {len(rows[0])} in line {lines[0]}"
            )
        rows.append(row)
        lines.append(number)
    if not rows:
        raise ValueError("it has no rows of numbers")
    values = np.array(rows, dtype=np.float64)
    if values.shape[1] > 1 and np.isnan(values[:, -1]).all():
        values = values[:, :-1]  # Every row ends with a separator.
    return Table(values, names, tuple(lines))


def _split(row: str) -> Sequence[str]:
    """Cells of a row, with decimal points; a comma between quotes is one."""
    row = _QUOTED.sub(lambda cell: cell[1].replace(",", "."), row)
    if ";" in row:
        return row.replace(",", ".").split(";")
    if "," in row and not _DECIMAL_COMMAS.fullmatch(row):
        return row.split(",")
    return row.replace(",", ".").split("\t" if "\t" in row else None)


def _is_index(column: Float64[np.ndarray, "n"]) -> bool:
    """Whether a column counts its rows, from 0 or 1."""
    return bool(np.array_equal(column - column[0], np.arange(len(column))) and column[0] in (0, 1))
