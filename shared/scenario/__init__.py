"""A scenario: one TOML file that says what rope, cell, obstacles, goal and settings a run has.

`load` reads and checks it. What cannot be checked without the rod (whether the rope at rest touches
something) is checked by `lariat check`, `run` and `up`.
"""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

from shared.aliases import with_current_keys
from shared.configuration import ConfigurationError, read
from shared.scenario.checks import check
from shared.scenario.scenario import Scenario
from shared.scenario.sections import SIDES, Event, Obstacle, Rope, Shape, Side
from shared.scenario.shipped import find
from shared.version import SCENARIO_VERSION

__all__ = [
    "SIDES",
    "ConfigurationError",
    "Event",
    "Obstacle",
    "Rope",
    "Scenario",
    "Shape",
    "Side",
    "find",
    "load",
    "parse",
]


def load(path: Path | str) -> Scenario:
    """The scenario of a file, checked.

    Args:
        path: The file, or the short name of a shipped scenario (see `find`).

    Raises:
        ConfigurationError: One line that names what is wrong, its value and the way out.
    """
    path = find(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(f"cannot read scenario {path}: {error}") from error
    return parse(text, folder=path.parent, source=str(path))


def parse(text: str, folder: Path, source: str = "scenario") -> Scenario:
    """The scenario of a text; CSV files are sought in `folder`."""
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(f"{source} is no valid TOML: {error}") from error
    for key in ("folder", "text"):
        if key in table:
            raise ConfigurationError(f"unknown key {key!r} in [top level]; remove it")
    _check_version(table, source)
    scenario = read(Scenario, with_current_keys(table))
    scenario = replace(scenario, folder=folder, text=text)
    check(scenario)
    return scenario


def _check_version(table: dict[str, Any], source: str) -> None:
    """Refuse a newer file by its version, before an unknown key of it is taken for a mistake."""
    version = table.get("version", SCENARIO_VERSION)
    if isinstance(version, int) and version > SCENARIO_VERSION:
        raise ConfigurationError(
            f"{source}: version = {version} is newer than this Lariat, which reads scenarios up to "
            f"version {SCENARIO_VERSION}; update it"
        )
