"""Values of a setting that a campaign varies, as people type them."""

from __future__ import annotations

from dashboard.panels.scenario.setting_fields import SettingField
from lariat.configuration import ConfigurationError
from lariat.files.toml_text import parse_toml


def values_of(field: SettingField, text: str) -> list[str]:
    """Return the values of a text such as "0.01, 0.02", each in TOML."""
    values = [field.setting(item).partition("=")[2] for item in _items(text)]
    if not values:
        raise ConfigurationError(f"{field.key} varies; type its values with commas between them")
    for value in values:
        if values.count(value) > 1:
            raise ConfigurationError(f"{field.key} = {value} stands there twice")
    return values


def _items(text: str) -> list[str]:
    """Split a text at its commas, but not at those inside of brackets."""
    items, depth = [""], 0
    for letter in text:
        depth += (letter == "[") - (letter == "]")
        if letter == "," and depth <= 0:
            items.append("")
        else:
            items[-1] += letter
    return [item.strip() for item in items if item.strip()]


def plain_value(value: str) -> str:
    """Return a value in TOML as people read it: a text without quotes."""
    # Nothing else is parsed: deep brackets exceed the parser's recursion.
    if not value.startswith(('"', "'")):
        return value
    try:
        return parse_toml(f"value = {value}")["value"]
    except ValueError:
        return value
