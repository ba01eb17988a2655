"""Palletizing commands: trays, grids of points in a row, a rectangle or a block."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from services.cr5_emulator import frames
from services.cr5_emulator.command_parser import parse_numbers
from services.cr5_emulator.commands.context import CommandContext, NamedValues, Table, Values
from services.cr5_emulator.commands.signature import (
    WRONG_COUNT,
    WRONG_TYPE,
    Command,
    Failure,
    Parameter,
)
from services.cr5_emulator.kinematics import Transform

TRAY_LIMIT = 20
"""Number of trays that a controller stores."""
NAME_LENGTH_LIMIT = 32
"""Largest length of a tray's name [characters]."""
TRAY_SIZES = Parameter("list", 2, 50.999)
"""Points along each direction."""
POINT_PATTERN = re.compile(r"pose\s*=\s*(\{[^{}]*\})", re.IGNORECASE)
"""A corner of a tray in the text of a call."""


@dataclass(frozen=True)
class Tray:
    """A grid between corners: P1 to P4 around the first layer, P5 to P8 around the last one."""

    sizes: tuple[int, ...]
    """Points along P1-P2, P1-P4 and P1-P5."""
    corners: tuple[Transform, ...]

    def point(self, index: int) -> Transform | None:
        """Return a point by its number from 1 on, or None; P1-P2 varies fastest, P1-P5 slowest."""
        if not 1 <= index <= int(np.prod(self.sizes)):
            return None
        index -= 1
        fractions = []
        for size in self.sizes:
            index, k = divmod(index, size)
            fractions.append(k / (size - 1))
        row, column, layer = (*fractions, 0.0, 0.0)[:3]
        first = self._in_layer(self.corners[:4], row, column)
        if len(self.corners) < 8:
            return first
        return frames.interpolate(first, self._in_layer(self.corners[4:], row, column), layer)

    def _in_layer(self, corners: tuple[Transform, ...], row: float, column: float) -> Transform:
        near = frames.interpolate(corners[0], corners[1], row)
        if len(corners) == 2:
            return near
        return frames.interpolate(near, frames.interpolate(corners[3], corners[2], row), column)


class PalletizingCommands:
    """Trays by name."""

    def __init__(self, context: CommandContext) -> None:
        self._context = context
        self._trays: dict[str, Tray] = {}

    def table(self) -> Table:
        """Return the commands by name."""
        text, point = Parameter("text"), Parameter("any")
        since = "4.5" if self._context.v4 else "3.5.7"
        return {
            "CreateTray": Command(
                self._create, (text, TRAY_SIZES), group=(point,), max_groups=8, since=since
            ),
            "GetTrayPoint": Command(self._get, (text, Parameter("integer", 1)), since=since),
        }

    def _create(self, values: Values, options: NamedValues) -> str:
        """Create a tray; points are given one by one in braces, or all in one pair of braces."""
        del options
        name, sizes, *texts = values
        if len(name) > NAME_LENGTH_LIMIT or name.isdigit() or not name.strip():
            raise Failure(-40001)
        found = [parse_numbers(text) for text in POINT_PATTERN.findall(",".join(texts))]
        if len(sizes) > 3 or len(found) != 2 ** len(sizes):
            raise Failure(WRONG_COUNT)
        if any(p is None or len(p) != 6 for p in found):
            raise Failure(WRONG_TYPE - 3)
        if name not in self._trays and len(self._trays) >= TRAY_LIMIT:
            raise Failure(-1)
        corners = tuple(frames.transform(np.array(p)) for p in found)
        self._trays[name] = Tray(tuple(int(s) for s in sizes), corners)
        return ""

    def _get(self, values: Values, options: NamedValues) -> str:
        del options
        name, index = values
        point = self._trays[name].point(index) if name in self._trays else None
        if point is None:
            return f"-1,{self._context.numbers(np.zeros(6))}"
        return f"0,{self._context.numbers(frames.vector(point))}"
