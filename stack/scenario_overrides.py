"""Overrides of single values of a scenario: `--set sensing.source=truth --set rope.length=0.5`.

The changed scenario is written out as TOML again, so that a recording holds the scenario that ran.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from lariat.configuration import ConfigurationError, parse_value
from lariat.files.toml_text import MAX_KEY_DEPTH, parse_toml
from lariat.scenario import Scenario, load, parse

MAX_SETTINGS = 200
"""Largest number of values that are replaced at once [-]."""


def load_with(path: Path, settings: Sequence[str], seed: int | None = None) -> Scenario:
    """Load a scenario file with some of its values replaced.

    Raises:
        ConfigurationError: The file or an override is invalid.
    """
    if seed is not None:
        settings = [*settings, f"seed={seed}"]
    scenario = load(path)
    return with_settings(scenario, settings) if settings else scenario


def with_settings(scenario: Scenario, settings: Sequence[str]) -> Scenario:
    """Return a scenario with some values of its file replaced; comments of the file are lost.

    Raises:
        ConfigurationError: A setting is invalid.
    """
    if not settings:
        return scenario
    if len(settings) > MAX_SETTINGS:
        raise ConfigurationError(f"{len(settings)} settings; give up to {MAX_SETTINGS} at once")
    table = parse_toml(scenario.text)
    for setting in settings:
        key, equals, value = setting.partition("=")
        if not equals or not key:
            raise ConfigurationError(f"--set {setting!r} has no value; write --set KEY=VALUE")
        _put(table, key.strip(), parse_value(value.strip()))
    source = f"{scenario.name} with {', '.join(settings)}"
    return parse(to_toml(table), scenario.folder, source=source)


def _put(table: dict[str, Any], key: str, value: Any) -> None:
    *path, last = key.split(".")
    if len(path) >= MAX_KEY_DEPTH:
        raise ConfigurationError(
            f"--set {key[:60]}…: the key has {len(path) + 1} parts; give up to {MAX_KEY_DEPTH}"
        )
    place: Any = table
    for depth, part in enumerate([*path, last]):
        if isinstance(place, list):
            if not part.isdigit() or int(part) >= len(place):
                where = ".".join(key.split(".")[:depth])
                raise ConfigurationError(
                    f"--set {key}: {where} is a list of {len(place)}; "
                    f"{part!r} must be a number from 0 to {len(place) - 1}"
                )
            part = int(part)
        elif not isinstance(place, dict):
            raise ConfigurationError(
                f"--set {key}: {part!r} is looked up in {place!r}, which is no table"
            )
        if depth == len(path):
            place[part] = value
        else:
            place = place.setdefault(part, {}) if isinstance(place, dict) else place[part]


def to_toml(table: Mapping[str, Any]) -> str:
    """TOML text of a table of tables, lists and scalars."""
    return "\n".join(_lines(table, ())) + "\n"


def _lines(table: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    plain, nested = [], []
    for key, value in table.items():
        name = ".".join((*path, key))
        if isinstance(value, Mapping):
            nested += ["", f"[{name}]", *_lines(value, (*path, key))]
        elif isinstance(value, list) and value and all(isinstance(v, Mapping) for v in value):
            for item in value:
                nested += ["", f"[[{name}]]", *_lines(item, (*path, key))]
        else:
            plain.append(f"{key} = {_scalar(value)}")
    return plain + nested


def _scalar(value: Any) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(_scalar(v) for v in value) + "]"
    # A JSON text without escapes beyond the Basic Multilingual Plane is a TOML text.
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str | bool) else repr(value)
