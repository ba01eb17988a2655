"""Aliases of renamed scenario keys, topics and message fields.

Each rename adds a row to one of the tables. Scenario files and recordings of earlier versions are
read under their old names; the bus carries the new names only.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lariat.configuration import ConfigurationError

SCENARIO_KEYS: dict[str, str] = {}
"""New dotted key by old dotted key, e.g. `{"limits.pull": "limits.contact_force"}`."""
TOPIC_KEYS: dict[str, str] = {}
"""New topic key by old topic key, e.g. `{"rope/chain": "rope/nodes"}`."""
MESSAGE_FIELDS: dict[str, str] = {}
"""New field name by message and old field name, e.g. `{"lariat.ArmState.pull": "force"}`.

Messages are decoded by field numbers, which a renamed field keeps; this table translates names."""


def with_current_keys(
    table: Mapping[str, Any], aliases: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """Return a copy of a scenario's table with its old keys renamed to the new ones.

    Args:
        table: Content of a scenario's TOML file.
        aliases: New dotted key by old dotted key; default: `SCENARIO_KEYS`.

    Raises:
        ConfigurationError: A value is given under both names.
    """
    result = _copy(table)
    for old, new in (SCENARIO_KEYS if aliases is None else aliases).items():
        *path, last = old.split(".")
        section = _section(result, path)
        if section is None or last not in section:
            continue
        value = section.pop(last)
        *path, last = new.split(".")
        target = result
        for part in path:
            target = target.setdefault(part, {})
        if last in target:
            raise ConfigurationError(f"{old} is the old name of {new}; give only {new}")
        target[last] = value
    return result


def current_topic_key(key: str, aliases: Mapping[str, str] | None = None) -> str:
    """Return the current key of a topic that is given by its current or an earlier key."""
    return (TOPIC_KEYS if aliases is None else aliases).get(key, key)


def current_field_name(message: str, field: str, aliases: Mapping[str, str] | None = None) -> str:
    """Return the current name of a field that is given by its current or an earlier name.

    Args:
        message: Full name of the message, e.g. `lariat.ArmState`.
        field: Name of the field.
        aliases: New name by old name with its message; default: `MESSAGE_FIELDS`.
    """
    return (MESSAGE_FIELDS if aliases is None else aliases).get(f"{message}.{field}", field)


def _copy(value: Any) -> Any:
    return {k: _copy(v) for k, v in value.items()} if isinstance(value, Mapping) else value


def _section(table: dict[str, Any], path: list[str]) -> dict[str, Any] | None:
    section: Any = table
    for part in path:
        if not isinstance(section, dict) or part not in section:
            return None
        section = section[part]
    return section if isinstance(section, dict) else None
