"""Trays: points spread evenly between the corners of a row, a sheet or a block."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from services.cr5_emulator import frames
from services.cr5_emulator.commands.execution import Execution, Options, Table, Values
from services.cr5_emulator.commands.signature import (
    WRONG_COUNT,
    WRONG_TYPE,
    Command,
    Failure,
    Parameter,
)
from services.cr5_emulator.geometry import Transform
from services.cr5_emulator.grammar import numbers

MOST = 20
"""Trays that a controller keeps."""
LONGEST_NAME = 32
SIZE = Parameter("list", 2, 50.999)
POINT = re.compile(r"pose\s*=\s*(\{[^{}]*\})", re.IGNORECASE)


@dataclass(frozen=True)
class Tray:
    """Corners P1 to P4 go round the first layer, P5 to P8 round the last one."""

    sizes: tuple[int, ...]
    """Points along P1-P2, P1-P4 and P1-P5."""
    corners: tuple[Transform, ...]

    def point(self, index: int) -> Transform | None:
        """The point of a number from 1 on, or None; along P1-P2 first, then P1-P4, then P1-P5."""
        if not 1 <= index <= int(np.prod(self.sizes)):
            return None
        index -= 1
        shares = []
        for size in self.sizes:
            index, k = divmod(index, size)
            shares.append(k / (size - 1))
        row, column, layer = (*shares, 0.0, 0.0)[:3]
        first = self._sheet(self.corners[:4], row, column)
        if len(self.corners) < 8:
            return first
        return frames.line(first, self._sheet(self.corners[4:], row, column), layer)

    def _sheet(self, corners: tuple[Transform, ...], row: float, column: float) -> Transform:
        near = frames.line(corners[0], corners[1], row)
        if len(corners) == 2:
            return near
        return frames.line(near, frames.line(corners[3], corners[2], row), column)


class Trays:
    """Those that were created, by name."""

    def __init__(self, execution: Execution) -> None:
        self._do = execution
        self._trays: dict[str, Tray] = {}

    def table(self) -> Table:
        """Commands by name."""
        text, point = Parameter("text"), Parameter("any")
        since = "4.5" if self._do.v4 else "3.5.7"
        return {
            "CreateTray": Command(self._create, (text, SIZE), group=(point,), most=8, since=since),
            "GetTrayPoint": Command(self._get, (text, Parameter("integer", 1)), since=since),
        }

    def _create(self, values: Values, options: Options) -> str:
        """Points come one by one in braces, or all in one pair of them."""
        del options
        name, sizes, *texts = values
        if len(name) > LONGEST_NAME or name.isdigit() or not name.strip():
            raise Failure(-40001)
        found = [numbers(text) for text in POINT.findall(",".join(texts))]
        if len(sizes) > 3 or len(found) != 2 ** len(sizes):
            raise Failure(WRONG_COUNT)
        if any(p is None or len(p) != 6 for p in found):
            raise Failure(WRONG_TYPE - 3)
        if name not in self._trays and len(self._trays) >= MOST:
            raise Failure(-1)
        corners = tuple(frames.transform(np.array(p)) for p in found)
        self._trays[name] = Tray(tuple(int(s) for s in sizes), corners)
        return ""

    def _get(self, values: Values, options: Options) -> str:
        del options
        name, index = values
        point = self._trays[name].point(index) if name in self._trays else None
        if point is None:
            return f"-1,{self._do.numbers(np.zeros(6))}"
        return f"0,{self._do.numbers(frames.vector(point))}"
