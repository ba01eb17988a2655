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

Kind = Literal["number", "integer", "flag", "text", "list", "any"]
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

    kind: Kind = "number"
    low: float = -1e9
    high: float = 1e9
    key: str = ""
    """Key of an optional parameter that may also be given as key=value."""
    count: int = 0
    """Length of a list; 0: any."""
    second_range: tuple[float, float] | None = None
    """Another range of valid values."""
    words: tuple[str, ...] = ()
    """Valid texts, in upper case; empty: any."""

    def read(self, text: str, wrong_type: int, out_of_range: int) -> Any:
        """Parse a value; raises Failure with one of the two codes."""
        match self.kind:
            case "any":
                return text
            case "text":
                return self._text(text, wrong_type, out_of_range)
            case "list":
                values = parse_numbers(text)
                if values is None or (self.count and len(values) != self.count):
                    raise Failure(wrong_type)
                if not all(self._fits(v) for v in values):
                    raise Failure(out_of_range)
                return values
            case "flag" if text.lower() in ("true", "false"):
                return int(text.lower() == "true")
        value = parse_number(text)
        if value is None or (self.kind != "number" and value != round(value)):
            raise Failure(wrong_type)
        if not self._fits(value):
            raise Failure(out_of_range)
        return value if self.kind == "number" else int(value)

    def _text(self, text: str, wrong_type: int, out_of_range: int) -> str:
        bare = text.strip("\"'")
        if not bare or text[:1] in "{(":
            raise Failure(wrong_type)
        if self.words and bare.upper() not in self.words:
            raise Failure(out_of_range)
        return bare

    def _fits(self, value: float) -> bool:
        if self.second_range is not None and self.second_range[0] <= value <= self.second_range[1]:
            return True
        return self.low <= value <= self.high


# Parameters of many commands.
NUMBER = Parameter()
SIX_NUMBERS = (NUMBER,) * 6
SWITCH = Parameter("flag", 0, 1)
PERCENT = Parameter("integer", 1, 100)
TEXT = Parameter("text")
POSE = Parameter("list", count=6)


def option(key: str, kind: Kind = "number", low: float = -1e9, high: float = 1e9) -> Parameter:
    """Create an optional parameter."""
    return Parameter(kind, low, high, key)


Run = Callable[[list[Any], dict[str, Any]], str | None]


@dataclass(frozen=True)
class Command:
    """One command of a firmware."""

    run: Run
    """Takes the positional values and the options; returns the reply's values, None to wait."""
    required: tuple[Parameter, ...] = ()
    optional: tuple[Parameter, ...] = ()
    group: tuple[Parameter, ...] = ()
    """Parameters after the required ones that come once or repeatedly."""
    max_groups: int = 64
    """Largest number of repetitions of the group."""
    counts: tuple[int, ...] | None = None
    """Allowed counts of positional arguments; None: every count from required to all."""
    points: tuple[int, int] = (0, 0)
    """V4: least and largest number of arguments joint={...} or pose={...}."""
    joints_only: bool = False
    """Whether pose={...} is refused."""
    ports: tuple[int, ...] = (COMMAND_PORT,)
    moves: bool = False
    """Whether the arm must be enabled."""
    since: str = ""
    """First release with this command; empty: all."""

    def read(self, call: Call, v4: bool) -> tuple[list[Any], dict[str, Any]]:
        """Parse the arguments of a call; raises Failure with the code of the first error."""
        points = self._points(call) if self.points[1] else []
        parameters = self._parameters(len(call.arguments))
        values = []
        for k, (text, parameter) in enumerate(zip(call.arguments, parameters, strict=True), 1):
            # Points come first and count as arguments.
            position = k + len(points)
            codes = WRONG_TYPE - position, OUT_OF_RANGE - position
            if v4 and k > len(self.required) and not self.group:
                codes = (
                    OPTION_TYPE - k + len(self.required),
                    OPTION_RANGE - k + len(self.required),
                )
            values.append(parameter.read(text, *codes))
        options = self._options(call, v4)
        if points:
            options["points"] = points
        return values, options

    def _parameters(self, count: int) -> tuple[Parameter, ...]:
        """Return the parameter of each positional argument."""
        if self.group:
            times, rest = divmod(count - len(self.required), len(self.group))
            if rest or not 1 <= times <= self.max_groups:
                raise Failure(WRONG_COUNT)
            return self.required + self.group * times
        # After a named point all arguments are named.
        optional = () if self.points[1] else self.optional
        everything = self.required + optional
        allowed = self.counts or tuple(range(len(self.required), len(everything) + 1))
        if count not in allowed:
            raise Failure(WRONG_COUNT)
        return everything[:count]

    def _points(self, call: Call) -> list[tuple[str, np.ndarray]]:
        named = [k for k in call.options if k.partition("#")[0] in ("joint", "pose")]
        if not self.points[0] <= len(named) <= self.points[1]:
            raise Failure(WRONG_COUNT)
        points = []
        for key in named:
            kind, values = key.partition("#")[0], parse_numbers(call.options[key])
            if values is None or (kind == "pose" and self.joints_only):
                raise Failure(WRONG_TYPE - 1)
            if kind == "joint" and max(map(abs, values)) > JOINT_ANGLE_LIMIT:
                raise Failure(OUT_OF_RANGE - 1)
            if len(values) != 6:
                raise Failure(WRONG_TYPE - 1)
            points.append((kind, np.array(values)))
        return points

    def _options(self, call: Call, v4: bool) -> dict[str, Any]:
        by_key = {p.key: p for p in self.optional if p.key}
        options: dict[str, Any] = {}
        for name, text in call.options.items():
            if self.points[1] and name.partition("#")[0] in ("joint", "pose"):
                continue
            if name not in by_key:
                raise Failure(WRONG_COUNT)
            codes = (OPTION_TYPE - 1, OPTION_RANGE - 1) if v4 else self._codes(name)
            options[name] = by_key[name].read(text, *codes)
        return options

    def _codes(self, name: str) -> tuple[int, int]:
        position = len(self.required) + [p.key for p in self.optional].index(name) + 1
        return WRONG_TYPE - position, OUT_OF_RANGE - position
