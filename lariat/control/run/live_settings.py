"""Settings of a scenario's section `control` that act while its cell runs.

Their keys are those of the section, e.g. `speed_weight` and `paper.learning_rate`; the text of a
value is TOML. The keys of `horizon_optimizer` for each method are listed beside it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any, get_type_hints

from lariat.configuration import parse_value, read_value
from lariat.scenario.sections import Control

OF_EVERY_METHOD = ("adapt", "clearance", "pace")
"""Keys that act whichever method controls the rope."""


def texts(control: Control, keys: tuple[str, ...]) -> dict[str, str]:
    """Return the values of some keys as texts."""
    return {key: _text(_value(control, key)) for key in keys}


def checked(key: str, text: str) -> str:
    """Return the text of a value, as `texts` writes it.

    Raises:
        ConfigurationError: It is no such value, or out of bounds.
    """
    return _text(read_value(_hint(key), parse_value(text), f"control.{key}"))


def applied(control: Control, settings: Mapping[str, str]) -> Control:
    """Return a section with the values of settings.

    Raises:
        ConfigurationError: A setting is no such value, or out of bounds.
    """
    values = {k: read_value(_hint(k), parse_value(v), f"control.{k}") for k, v in settings.items()}
    paper = {k.partition(".")[2]: v for k, v in values.items() if "." in k}
    own = {k: v for k, v in values.items() if "." not in k}
    return replace(control, paper=replace(control.paper, **paper), **own)


def _value(control: Control, key: str) -> Any:
    value: Any = control
    for name in key.split("."):
        value = getattr(value, name)
    return value


def _text(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else repr(value)


@cache
def _hint(key: str) -> Any:
    kind: Any = Control
    for name in key.split("."):
        kind = get_type_hints(kind, include_extras=True)[name]
    return kind
