"""Signatures of commands: parameters, and the error codes of wrong arguments.

The vendor's rules: the count of arguments is checked before their types; then the first error from
the left is reported. V3 numbers all arguments in one sequence. V4 numbers required and optional
ones separately; named ones, `joint={...}` or `v=20`, always have the number 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from services.cr5_emulator.command_parser import Call, parse_number, parse_numbers

NO_SUCH_COMMAND = -10000
WRONG_COUNT = -20000
WRONG_TYPE = -30000
OUT_OF_RANGE = -40000
OPTION_TYPE = -50000
OPTION_RANGE = -60000
"""Error codes; the number of the argument is subtracted from the last four."""
JOINT_ANGLE_LIMIT = 360.0
"""Largest magnitude of a named joint angle that is accepted [deg]."""

COMMAND_PORT, MOTION_PORT = 29999, 30003
"""Ports that take commands; V4 has only the first."""


class Failure(Exception):
    """Refusal of a command, with an error code for the reply."""

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


@dataclass(frozen=True)
class Parameter:
    """One parameter."""

    kind: Literal["number", "integer", "six", "any"] = "number"
    """`six`: six numbers in braces."""
    low: float = -1e9
    high: float = 1e9
    key: str = ""
    """Key of an optional parameter that may also be given as key=value."""

    def read(self, text: str, wrong_type: int, out_of_range: int) -> Any:
        """Parse a value; raises Failure with one of the two codes."""
        if self.kind == "any":
            return text
        if self.kind == "six":
            values = parse_numbers(text)
            if values is None or len(values) != 6:
                raise Failure(wrong_type)
            return values
        value = parse_number(text)
        if value is None or (self.kind == "integer" and value != round(value)):
            raise Failure(wrong_type)
        if not self.low <= value <= self.high:
            raise Failure(out_of_range)
        return value if self.kind == "number" else int(value)


NUMBER = Parameter()
SIX_NUMBERS = (NUMBER,) * 6
SWITCH = Parameter("integer", 0, 1)
PERCENT = Parameter("integer", 1, 100)


def percent(*keys: str, low: float = 1) -> tuple[Parameter, ...]:
    """Create optional parameters for percentages."""
    return tuple(Parameter("number", low, 100, key) for key in keys)


@dataclass(frozen=True)
class Command:
    """One command of a firmware."""

    run: Callable[[list[Any], dict[str, Any]], str | None]
    """Takes the positional values and the options; returns the reply's values, None to wait."""
    required: tuple[Parameter, ...] = ()
    optional: tuple[Parameter, ...] = ()
    counts: tuple[int, ...] | None = None
    """Allowed counts of positional arguments; None: every count from required to all."""
    point: bool = False
    """Whether the target is an argument joint={...} or pose={...}, and all others are named."""
    port: int = COMMAND_PORT
    moves: bool = False
    """Whether the arm must be enabled."""
    since: str = ""
    """First release with this command; empty: all."""

    def read(self, call: Call, v4: bool) -> tuple[list[Any], dict[str, Any]]:
        """Parse the arguments of a call; raises Failure with the code of the first error."""
        point = self._point(call) if self.point else None
        count, least = len(call.arguments), len(self.required)
        parameters = self.required if self.point else self.required + self.optional
        if count not in (self.counts or range(least, len(parameters) + 1)):
            raise Failure(WRONG_COUNT)
        values = []
        for k, (text, parameter) in enumerate(zip(call.arguments, parameters, strict=False), 1):
            codes = WRONG_TYPE - k, OUT_OF_RANGE - k
            if v4 and k > least:
                codes = OPTION_TYPE - k + least, OPTION_RANGE - k + least
            values.append(parameter.read(text, *codes))
        options = self._options(call, v4)
        if point is not None:
            options["point"] = point
        return values, options

    def _point(self, call: Call) -> tuple[str, np.ndarray]:
        named = [k for k in call.options if k.partition("#")[0] in ("joint", "pose")]
        if len(named) != 1:
            raise Failure(WRONG_COUNT)
        values = parse_numbers(call.options[named[0]])
        if values is None:
            raise Failure(WRONG_TYPE - 1)
        if named[0] == "joint" and max(map(abs, values)) > JOINT_ANGLE_LIMIT:
            raise Failure(OUT_OF_RANGE - 1)
        if len(values) != 6:
            raise Failure(WRONG_TYPE - 1)
        return named[0], np.array(values)

    def _options(self, call: Call, v4: bool) -> dict[str, Any]:
        keys = [p.key for p in self.optional]
        options: dict[str, Any] = {}
        for name, text in call.options.items():
            if self.point and name in ("joint", "pose"):
                continue
            if name not in keys:
                raise Failure(WRONG_COUNT)
            position = len(self.required) + keys.index(name) + 1
            codes = (OPTION_TYPE, OPTION_RANGE, 1) if v4 else (WRONG_TYPE, OUT_OF_RANGE, position)
            parameter = self.optional[keys.index(name)]
            options[name] = parameter.read(text, codes[0] - codes[2], codes[1] - codes[2])
        return options
