"""Scenarios with other values: by settings such as `{"rope.length": 0.5}`, or replaced in Python.

The changed scenario is written out as TOML again, so that a recording holds the scenario that ran.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from lariat.configuration import ConfigurationError, parse_value
from lariat.files.toml_text import MAX_KEY_DEPTH, parse_toml
from lariat.scenario import Scenario, load, parse
from lariat.scenario.reference import INTERNAL_FIELDS

MAX_SETTINGS = 200
"""Largest number of values that are replaced at once [-]."""

Settings: TypeAlias = Mapping[str, Any] | Sequence[str]
"""Values by their dotted keys, or texts `KEY=VALUE` with values in TOML."""


def load_with(path: Path | str, settings: Settings = (), seed: int | None = None) -> Scenario:
    """Load a scenario file with some of its values replaced.

    Args:
        path: The file, or the short name of a shipped scenario.
        settings: Values that replace the file's, e.g. `{"rope.length": 0.5}`; the number in
            `obstacles.0.radius` is the index in a list.
        seed: Replaces the seed.

    Raises:
        ConfigurationError: The file or a setting is invalid.
    """
    scenario = with_settings(load(path), settings)
    return scenario if seed is None else with_settings(scenario, {"seed": seed})


def with_settings(scenario: Scenario, settings: Settings) -> Scenario:
    """Return a scenario with some values replaced; comments of its file are lost.

    Args:
        scenario: The scenario.
        settings: Values that replace its own, as `load_with` takes them.

    Raises:
        ConfigurationError: A setting is invalid.
    """
    if not settings:
        return scenario
    if len(settings) > MAX_SETTINGS:
        raise ConfigurationError(f"{len(settings)} settings; give up to {MAX_SETTINGS} at once")
    if not isinstance(settings, Mapping):
        settings = dict(map(_parsed, settings))
    table = parse_toml(completed(scenario).text)
    for key, value in settings.items():
        _put(table, key, _entry(value))
    names = ", ".join(f"{key}={_scalar(_entry(value))}" for key, value in settings.items())
    return parse(to_toml(table), scenario.folder, source=f"{scenario.name} with {names[:200]}")


def completed(scenario: Scenario) -> Scenario:
    """Return a scenario, checked, with a text that gives it.

    After `dataclasses.replace` the text is still that of the file; it is written anew where it
    gives another scenario.

    Raises:
        ConfigurationError: A value is wrong, or two contradict each other.
    """
    with suppress(ConfigurationError):
        if scenario.text and parse(scenario.text, scenario.folder) == scenario:
            return scenario
    table = _entry(scenario)
    table["rope"]["length"] = scenario.rope.length + scenario.held_length
    return parse(to_toml(table), scenario.folder, source=scenario.name)


def _parsed(setting: str) -> tuple[str, Any]:
    key, equals, value = setting.partition("=")
    if not equals or not key:
        raise ConfigurationError(f"--set {setting!r} has no value; write --set KEY=VALUE")
    return key.strip(), parse_value(value.strip())


def _entry(value: Any) -> Any:
    """Value as TOML has it: a dataclass as a table of what differs from its defaults."""
    if is_dataclass(value) and not isinstance(value, type):
        table = {}
        for item in fields(value):
            own = getattr(value, item.name)
            default = item.default if item.default_factory is MISSING else item.default_factory()
            if item.name not in INTERNAL_FIELDS and own is not None and own != default:
                table[item.name] = _entry(own)
        return table
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return {name: _entry(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_entry(each) for each in value]
    return str(value) if isinstance(value, Path) else value


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
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key} = {_scalar(v)}" for key, v in value.items()) + "}"
    # A JSON text without escapes beyond the Basic Multilingual Plane is a TOML text.
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str | bool) else repr(value)
