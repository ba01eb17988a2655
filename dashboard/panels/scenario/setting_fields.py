"""Fields of a scenario's settings, generated from the dataclasses of the configuration."""

from __future__ import annotations

import json
import types
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass
from functools import cache
from importlib.metadata import entry_points
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from lariat.configuration import Bounds, Extensible, parse_value, read_value
from lariat.files.toml_text import parse_toml
from lariat.scenario import Scenario
from lariat.scenario.reference import field_notes

FIRST_SECTIONS = ("control", "run", "limits", "rope", "sensing", "plant")
"""Sections that stand first in the list."""
TOP_LEVEL = "scenario"
"""Name of the section of the keys without a section."""
HIDDEN = ("name", "version", "folder", "text")
"""Fields of the top level that are no settings."""
_offers = cache(entry_points)
"""All that installed packages offer, which takes many files to find out."""


@dataclass(frozen=True)
class SettingField:
    """One value of a scenario file that a person may change."""

    key: str
    """Dotted key in the file."""
    unit: str
    """Unit; empty without one."""
    value: str
    """Present value as text; empty where the file gives none and there is no default."""
    options: tuple[str, ...]
    """Values to choose from; empty where any text is allowed."""
    hint: str
    """Meaning, bounds and default."""
    annotation: Any
    """Annotation of the dataclass' field."""

    @property
    def name(self) -> str:
        """Key without its section."""
        return self.key.rpartition(".")[2]

    @property
    def bounds(self) -> Bounds | None:
        """Bounds of a number; None without any."""
        bounds = _plain(self.annotation)[1]
        return bounds if isinstance(bounds, Bounds) else None

    def setting(self, text: str) -> str:
        """Return the setting of a text, as requests for scenarios take it."""
        value = text if self._is_text else parse_value(text)
        read_value(self.annotation, value, self.key)
        return f"{self.key}={_as_text(value, quoted=True)}"

    @property
    def _is_text(self) -> bool:
        kind = _plain(self.annotation)[0]
        return kind is str or get_origin(kind) is Literal


def sections(scenario: Scenario) -> dict[str, tuple[SettingField, ...]]:
    """Return the fields of every section of a scenario, by the section's key.

    Obstacles, events and cameras are left to the scene's editors and to the file: there may be any
    number of them.
    """
    table = parse_toml(scenario.text)
    by_section = dict(_sections(Scenario, table, ""))
    first = [key for key in FIRST_SECTIONS if key in by_section]
    return {key: by_section[key] for key in (*first, *(k for k in by_section if k not in first))}


def _sections(
    kind: type, table: Mapping[str, Any], path: str
) -> Iterator[tuple[str, tuple[SettingField, ...]]]:
    hints = get_type_hints(kind, include_extras=True)
    notes = field_notes(kind)
    settings = []
    nested = []
    for item in fields(kind):
        if not path and item.name in HIDDEN:
            continue
        hint, key = hints[item.name], f"{path}.{item.name}" if path else item.name
        plain, bounds = _plain(hint)
        if is_dataclass(plain):
            # A section that may be missing cannot be begun here: its values have no defaults.
            if get_origin(hint) not in (Union, types.UnionType):
                nested.append((plain, table.get(item.name, {}), key))
        elif not _holds_sections(plain):
            settings.append(_field(key, item, hint, bounds, notes.get(item.name, ""), table))
    if settings:
        yield path or TOP_LEVEL, tuple(settings)
    for each in nested:
        yield from _sections(*each)


def _plain(hint: Any) -> tuple[Any, Bounds | Extensible | None]:
    """Return an annotation without `None` and `Annotated`, and its bounds."""
    bounds = None
    while True:
        if get_origin(hint) is Annotated:
            hint, bounds = get_args(hint)[:2]
        elif get_origin(hint) in (Union, types.UnionType):
            # Where there is a choice, the text stands first.
            hint = next(a for a in get_args(hint) if a is not type(None))
        else:
            return hint, bounds


def _holds_sections(kind: Any) -> bool:
    return get_origin(kind) in (tuple, dict) and any(is_dataclass(a) for a in get_args(kind))


def _field(
    key: str,
    item: Field[Any],
    hint: Any,
    bounds: Bounds | Extensible | None,
    note: str,
    table: Mapping[str, Any],
) -> SettingField:
    kind = _plain(hint)[0]
    default = "" if item.default in (MISSING, None) else _as_text(item.default)
    value = _as_text(table[item.name]) if item.name in table else default
    options: tuple[str, ...] = ()
    parts = [note]
    if isinstance(bounds, Extensible):
        offered = (*bounds.included, *_names_from_outside(bounds.group), value)
        options = tuple(dict.fromkeys(offered))
    elif get_origin(kind) is Literal:
        options = get_args(kind)
    elif kind is bool:
        options = ("true", "false")
    if isinstance(bounds, Bounds):
        parts.append(f"{bounds.low:g} … {bounds.high:g} {bounds.unit}".strip() + ".")
    if default:
        parts.append(f"Default: {default}.")
    unit = bounds.unit if isinstance(bounds, Bounds) else ""
    return SettingField(key, unit, value, options, " ".join(filter(None, parts)), hint)


def _names_from_outside(group: str) -> tuple[str, ...]:
    """Names of the classes that installed packages offer in a group."""
    return tuple(point.name for point in _offers().select(group=group))


def _as_text(value: Any, quoted: bool = False) -> str:
    """Text of a value in TOML; a text itself is quoted only on demand."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False) if quoted else value
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list | tuple):
        return f"[{', '.join(_as_text(v, quoted=True) for v in value)}]"
    return repr(value)
