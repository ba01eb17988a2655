"""Scenarios: TOML files with the rope, cell, obstacles, goal and settings of a run.

`load` reads and checks a file. `lariat.planning.preflight` checks the rest, which takes
the rod: whether the rope at rest touches an obstacle.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from lariat.configuration import ConfigurationError, read, refusing
from lariat.files.bounded_file import read_file
from lariat.files.file_kind import TEXT_KINDS, kind_of
from lariat.files.toml_text import parse_toml
from lariat.scenario.checks import check
from lariat.scenario.scenario import SCENARIO_VERSION, Scenario
from lariat.scenario.sections import SIDES, Event, Goal, Obstacle, Rope, Shape, Side
from lariat.scenario.shipped import find

__all__ = [
    "MAX_SCENARIO_SIZE",
    "SIDES",
    "ConfigurationError",
    "Event",
    "Goal",
    "Obstacle",
    "Rope",
    "Scenario",
    "Shape",
    "Side",
    "find",
    "load",
    "parse",
]

SUFFIX = ".toml"
"""Suffix of a scenario's file."""
MAX_SCENARIO_SIZE = 2**20
"""Largest scenario file [bytes]."""
MAX_HELD_SHARE = 0.5
"""Largest share of a rope's length that lies in its grippers [-]."""


def load(path: Path | str) -> Scenario:
    """Read and check a scenario file.

    Args:
        path: The file, or the short name of a shipped scenario (see `find`).

    Raises:
        ConfigurationError: The file cannot be read or a value in it is wrong.
    """
    with refusing(f"cannot read scenario {path}"):
        path = find(path)
        content = read_file(path, MAX_SCENARIO_SIZE)
    try:
        text = content.decode()
    except UnicodeDecodeError as error:
        line = 1 + content[: error.start].count(b"\n")
        texts = path.suffix == SUFFIX and b"\0" not in content
        fault = f"line {line} is not UTF-8" if texts else f"it is {kind_of(path)}, not a TOML file"
        raise ConfigurationError(f"cannot read scenario {path}: {fault}") from error
    named = path.suffix == SUFFIX or path.suffix not in TEXT_KINDS
    source = str(path) if named else f"{path} is {kind_of(path)}"
    return parse(text, folder=path.parent, source=source)


def parse(text: str, folder: Path, source: str = "scenario") -> Scenario:
    """Read and check the text of a scenario.

    Args:
        text: Content of a TOML file.
        folder: Folder of its CSV files.
        source: Name of the text in errors.

    Raises:
        ConfigurationError: The text is not TOML or a value in it is wrong.
    """
    with refusing(f"{source}: not valid TOML"):
        table = parse_toml(text)
    with refusing(source):
        for key in ("folder", "text"):
            if key in table:
                raise ConfigurationError(f"unknown key {key!r} in [top level]; remove it")
        _check_version(table, source)
        _check_removed_keys(table)
        scenario = read(Scenario, table)
        scenario = replace(scenario, rope=_rope_between_grips(scenario), folder=folder, text=text)
        check(scenario)
    return scenario


def _rope_between_grips(scenario: Scenario) -> Rope:
    """Return the rope without what lies in the grippers."""
    held_length, rope = scenario.held_length, scenario.rope
    for key, length in (("rope", rope.length), ("plant.rope", scenario.plant.rope.length)):
        if length is not None and held_length > MAX_HELD_SHARE * length:
            raise ConfigurationError(
                f"ends.left.grip_length + ends.right.grip_length = {held_length:g} m is more than "
                f"{MAX_HELD_SHARE:g} of {key}.length = {length:g} m; the length of a rope includes "
                "what lies in its grippers"
            )
    try:
        return replace(rope, length=rope.length - held_length)
    except ValueError as error:
        raise ConfigurationError(f"[rope] between its grips: {error}") from error


def _check_version(table: dict[str, Any], source: str) -> None:
    """Refuse a newer file by its version, before its new keys are reported as unknown."""
    version = table.get("version", SCENARIO_VERSION)
    if isinstance(version, int) and version > SCENARIO_VERSION:
        raise ConfigurationError(
            f"{source}: version = {version} is newer than this Lariat, which reads scenarios up to "
            f"version {SCENARIO_VERSION}; update Lariat"
        )


def _check_removed_keys(table: dict[str, Any]) -> None:
    """Refuse a key that an option of a person has replaced."""
    recording = table.get("recording")
    if isinstance(recording, dict) and "keep" in recording:
        raise ConfigurationError(
            "recording.keep is no key of a scenario, which deletes nothing; remove it, and give "
            "`lariat up --keep GB` to limit the size of all recordings"
        )
