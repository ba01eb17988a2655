"""Every refusal names the key, the value and the way out."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import pytest

from lariat.configuration import Bounds, ConfigurationError, read


@dataclass(frozen=True)
class Spring:
    stiffness: Annotated[float, Bounds(1.0, 1e6, "N/m")]
    coils: Annotated[int, Bounds(1, 100)] = 5
    kind: Literal["steel", "brass"] = "steel"
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        if self.kind == "brass" and self.coils > 50:
            raise ValueError(f"coils = {self.coils} are too many for brass; at most 50")


@dataclass(frozen=True)
class Machine:
    name: str
    spring: Spring
    spares: tuple[Spring, ...] = ()
    limit: Annotated[float, Bounds(0.0, 1.0, "s")] | None = None
    on: bool = field(default=True)


def test_a_table_is_read_into_dataclasses() -> None:
    machine = read(
        Machine,
        {
            "name": "m",
            "spring": {"stiffness": 3, "axis": [1, 0, 0]},
            "spares": [{"stiffness": 2.0}, {"stiffness": 4.0, "kind": "brass"}],
            "limit": 0.5,
        },
    )
    assert machine == Machine(
        "m",
        Spring(3.0, axis=(1.0, 0.0, 0.0)),
        (Spring(2.0), Spring(4.0, kind="brass")),
        0.5,
    )
    assert isinstance(machine.spring.stiffness, float)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"sprng": {}}, "unknown key 'sprng' in [top level]; did you mean 'spring'?"),
        ({"spring": {}}, "spring.stiffness is missing; it has no default"),
        ({"spring": 7}, "spring must be a table, got 7; write [spring]"),
        ({"name": 7}, "name = 7 must be a str"),
        ({"on": 1}, "on = 1 must be a bool"),
        (
            {"spring": {"stiffness": -1.0}},
            "spring.stiffness = -1.0 N/m is out of bounds; give a value between 1 and 1e+06 N/m",
        ),
        (
            {"spring": {"stiffness": 10**400}},
            f"spring.stiffness = {10**400} must be finite, and within ±1e+15",
        ),
        (
            {"spring": {"stiffness": float("nan")}},
            "spring.stiffness = nan must be finite, and within ±1e+15",
        ),
        ({"spring": {"stiffness": "3"}}, "spring.stiffness = '3' must be a float"),
        ({"spring": {"stiffness": True}}, "spring.stiffness = True must be a float"),
        ({"spring": {"stiffness": 1.0, "coils": 2.5}}, "spring.coils = 2.5 must be a int"),
        (
            {"spring": {"stiffness": 1.0, "kind": "wood"}},
            "spring.kind = 'wood' is not one of 'steel', 'brass'",
        ),
        (
            {"spring": {"stiffness": 1.0, "axis": [1.0, 2.0]}},
            "spring.axis takes 3 values, got 2: [1.0, 2.0]",
        ),
        (
            {"spares": [{"stiffness": 1.0}, {"stiffness": 0.0}]},
            "spares[1].stiffness = 0.0 N/m is out of bounds; give a value between 1 and 1e+06 N/m",
        ),
        (
            {"spring": {"stiffness": 1.0, "kind": "brass", "coils": 60}},
            "[spring] coils = 60 are too many for brass; at most 50",
        ),
        (
            {"limit": 2.0},
            "limit = 2.0 s is out of bounds; give a value between 0 and 1 s",
        ),
    ],
)
def test_an_error_names_the_value_and_the_way_out(change: dict[str, Any], line: str) -> None:
    table = {"name": "m", "spring": {"stiffness": 1.0}, **change}
    with pytest.raises(ConfigurationError, match=f"^{re.escape(line)}$"):
        read(Machine, table)
