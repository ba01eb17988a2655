"""What a command takes, and the error code for what it was given instead."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from services.robot_gateway.emulator.grammar import Call, number, numbers

NO_SUCH_COMMAND = -10000
WRONG_COUNT = -20000
WRONG_TYPE = -30000
OUT_OF_RANGE = -40000
OPTION_TYPE = -50000
OPTION_RANGE = -60000

Kind = Literal["number", "integer", "text", "list"]


class Failure(Exception):  # an answer, not a defect
    """A command is answered with an error code."""

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


@dataclass(frozen=True)
class Parameter:
    """One argument."""

    kind: Kind = "number"
    low: float = -1e9
    high: float = 1e9
    key: str = ""
    """Under which an optional one may also come as key=value."""
    count: int = 0
    """Numbers in a list; 0: any."""

    def read(self, text: str, wrong_type: int, out_of_range: int) -> Any:
        """The value; Failure with one of the codes otherwise."""
        if self.kind == "text":
            return text.strip('"')
        if self.kind == "list":
            values = numbers(text)
            if values is None or (self.count and len(values) != self.count):
                raise Failure(wrong_type)
            return values
        value = number(text)
        if value is None or (self.kind == "integer" and value != round(value)):
            raise Failure(wrong_type)
        if not self.low <= value <= self.high:
            raise Failure(out_of_range)
        return int(value) if self.kind == "integer" else value


@dataclass(frozen=True)
class Command:
    """One command of a firmware."""

    run: Callable[[list[Any], dict[str, Any]], str | None]
    """With the positional values and the options; returns the values to answer, None to wait."""
    required: tuple[Parameter, ...] = ()
    optional: tuple[Parameter, ...] = ()
    counts: tuple[int, ...] | None = None
    """Allowed numbers of positional arguments, where not every one of the optional ones is."""
    points: int = 0
    """V4: how many of joint={...} or pose={...} it takes."""
    port: int = 29999
    moves: bool = False
    """Whether the arm must be enabled."""

    def read(self, call: Call, v4: bool) -> tuple[list[Any], dict[str, Any]]:
        """The values of a call; Failure with the code of the first thing wrong from the left."""
        texts = call.arguments
        most = len(self.required) + len(self.optional)
        # Where a point is named, everything behind it is named too.
        most = len(self.required) if self.points else most
        allowed = self.counts or tuple(range(len(self.required), most + 1))
        if len(texts) not in allowed:
            raise Failure(WRONG_COUNT)
        values = []
        for k, text in enumerate(texts, start=1):
            optional = v4 and k > len(self.required)
            parameter = (*self.required, *self.optional)[k - 1]
            type_code, range_code = WRONG_TYPE - k, OUT_OF_RANGE - k
            if optional:
                k -= len(self.required)
                type_code, range_code = OPTION_TYPE - k, OPTION_RANGE - k
            values.append(parameter.read(text, type_code, range_code))
        return values, self._options(call, v4)

    def _options(self, call: Call, v4: bool) -> dict[str, Any]:
        given = dict(call.options)
        options: dict[str, Any] = {}
        for k in range(self.points):
            suffix = f"#{k + 1}" if k else ""
            for name in ("joint", "pose"):
                text = given.pop(name + suffix, None)
                if text is not None:
                    values = numbers(text)
                    if values is None or len(values) != 6:
                        raise Failure(WRONG_TYPE - k - 1)
                    options.setdefault("points", []).append((name, np.array(values)))
        if len(options.get("points", [])) != self.points:
            raise Failure(WRONG_TYPE - 1 if self.points else WRONG_COUNT)
        known = {p.key: p for p in self.optional if p.key}
        for name, text in given.items():
            if name not in known:
                raise Failure(WRONG_COUNT)
            codes = (OPTION_TYPE - 1, OPTION_RANGE - 1) if v4 else self._codes(name)
            options[name] = known[name].read(text, *codes)
        return options

    def _codes(self, name: str) -> tuple[int, int]:
        place = len(self.required) + [p.key for p in self.optional].index(name) + 1
        return WRONG_TYPE - place, OUT_OF_RANGE - place
