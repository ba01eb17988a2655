"""Entries of a scenario file in TOML, from poses and bodies of a running cell."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from lariat.geometry.obstacles import Obstacle

DIGITS = 6
"""Decimals of a number in an entry."""


def obstacle_entry(body: Obstacle) -> dict[str, Any]:
    """Return the entry of an obstacle."""
    table: dict[str, Any] = {
        "name": body.name,
        "shape": body.shape,
        "position": numbers(body.position),
        "orientation": numbers(body.orientation),
        "support": body.support,
    }
    if body.friction:
        table["friction"] = round(float(body.friction), DIGITS)
    for key in body.row.fields:
        value = getattr(body, key)
        table[key] = numbers(value) if key == "size" else round(float(value), DIGITS)
    if body.shape == "half_space":
        table["normal"] = numbers(body.normal)
    return table


def numbers(values: Sequence[float]) -> list[float]:
    """Return numbers rounded to `DIGITS` decimals."""
    # Plus zero: -0.0 would be written as such.
    return [round(float(v), DIGITS) + 0.0 for v in values]


def inline(value: Any) -> str:
    """Return a value as TOML in one line; a table is an inline table."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key} = {inline(item)}' for key, item in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(inline(v) for v in value)}]"
    # A text, a number and a truth value are the same in JSON and TOML.
    return json.dumps(value, ensure_ascii=False)
