"""Strict conversion of TOML tables to frozen dataclasses.

Every error names the key, the value and the way out. The bounds of a number are part of its
annotation: `length: Annotated[float, Bounds(0.01, 100.0, "m")]`.
"""

from __future__ import annotations

import math
import types
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache
from importlib.metadata import entry_points
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from lariat.files.toml_text import parse_toml
from lariat.plain_text import is_plain, plain_text
from lariat.suggestion import did_you_mean

T = TypeVar("T")

MAX_NUMBER = 1e15
"""Largest magnitude of a number; below it, integers are exact as floats."""
MAX_TEXT_LENGTH = 1000
"""Largest number of characters of a text; a message of the bus takes four times as many."""
MAX_REASON_LENGTH = 1000
"""Largest number of characters of a refusal's reason, which may quote what is refused."""


class ConfigurationError(ValueError):
    """Input of a user is wrong; the text is one line that says what and how to mend it."""


def reason_of(error: Exception) -> str:
    """Return why something of others is refused, in one line."""
    match error:
        case RecursionError():
            text = "it is nested too deeply"
        case MemoryError():
            text = "it takes more memory than there is"
        case ValueError() | OSError():
            text = str(error)
        case _:
            text = f"{type(error).__name__}: {error}"
    return plain_text(" ".join(text.split())[:MAX_REASON_LENGTH])


@contextmanager
def refusing(what: object) -> Iterator[None]:
    """Turn any exception, while a file of others is handled, into a `ConfigurationError`.

    Args:
        what: What cannot be done then, for the message, e.g. `cannot export run.mcap`.

    Raises:
        ConfigurationError: The text names what, and why.
    """
    try:
        yield
    except ConfigurationError:
        raise
    except Exception as error:
        raise ConfigurationError(f"{what}: {reason_of(error)}") from error


@dataclass(frozen=True)
class Bounds:
    """Bounds of a number, both included."""

    low: float
    """Least allowed value."""
    high: float
    """Largest allowed value."""
    unit: str = ""
    """Unit of the number, for messages and documentation."""
    min_norm: float = 0.0
    """Least norm of a vector of such numbers."""


@dataclass(frozen=True)
class Extensible:
    """Names of a choice to which other packages may add: `Annotated[str, Extensible(…)]`."""

    included: tuple[str, ...]
    """Names of Lariat's own."""
    group: str
    """Group of entry points in which packages name theirs."""

    def check(self, name: str, key: str) -> None:
        """Check a name without importing anything.

        Raises:
            ConfigurationError: It is neither a known name nor of the form `package.module:Class`.
        """
        module, colon, attribute = name.partition(":")
        parts = [*module.split("."), attribute] if colon else []
        if name in self.included or (colon and all(part.isidentifier() for part in parts)):
            return
        names = [*self.included, *(point.name for point in entry_points(group=self.group))]
        if name in names:
            return
        hint = did_you_mean(name, names) or " or give 'package.module:Class'"
        options = ", ".join(repr(each) for each in names)
        raise ConfigurationError(f"{key} = {name!r} is not one of {options};{hint}")


def read(kind: type[T], table: Mapping[str, Any], path: str = "") -> T:
    """Return an instance of a dataclass with the values of a TOML table.

    Args:
        kind: The dataclass; fields may be numbers, texts, literals, tuples, dataclasses and
            tables of dataclasses by name.
        table: The table.
        path: Dotted key of the table itself, for messages.

    Raises:
        ConfigurationError: A key is unknown or missing, or a value has the wrong type or is out of
            bounds.
    """
    hints = _type_hints(kind)
    known_fields = {f.name: f for f in fields(kind)}  # pyright: ignore[reportArgumentType]
    for key in table:
        if key not in known_fields:
            raise ConfigurationError(_unknown(key, list(known_fields), path))
    values = {}
    for name, item in known_fields.items():
        key = f"{path}.{name}" if path else name
        if name in table:
            values[name] = _value(hints[name], table[name], key)
        elif item.default is MISSING and item.default_factory is MISSING:
            raise ConfigurationError(f"{key} is missing; it has no default")
    try:
        return kind(**values)
    except ConfigurationError:
        raise
    except ValueError as error:
        raise ConfigurationError(f"[{path}] {error}" if path else str(error)) from error


def read_value(hint: Any, value: Any, key: str) -> Any:
    """Return one value of a TOML table as a field of a dataclass holds it.

    Args:
        hint: Annotation of the field, with its bounds.
        value: The value.
        key: Dotted key, for messages.

    Raises:
        ConfigurationError: The value has the wrong type or is out of bounds.
    """
    return _value(hint, value, key)


def parse_value(text: str) -> Any:
    """Return the value of a TOML text; a text that is not TOML stands for itself."""
    try:
        return parse_toml(f"value = {text}")["value"]
    except ValueError:
        return text


@cache
def _type_hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind, include_extras=True)


def _unknown(key: str, keys: list[str], path: str) -> str:
    hint = did_you_mean(key, keys) or f" known keys: {', '.join(keys)}"
    return f"unknown key {key!r} in [{path or 'top level'}];{hint}"


def _value(hint: Any, value: Any, key: str) -> Any:
    bounds = None
    if get_origin(hint) is Annotated:
        hint, bounds = get_args(hint)[:2]
    origin = get_origin(hint)
    if origin in (Union, types.UnionType):
        kinds = [a for a in get_args(hint) if a is not type(None)]
        # Where there is a choice, it is between a text and something else.
        hint = next((a for a in kinds if (a is str) == isinstance(value, str)), kinds[0])
        return _value(Annotated[hint, bounds] if bounds else hint, value, key)
    if isinstance(bounds, Extensible):
        name = _scalar(str, None, value, key)
        bounds.check(name, key)
        return name
    if is_dataclass(hint):
        if not isinstance(value, Mapping):
            raise ConfigurationError(f"{key} must be a table, got {value!r}; write [{key}]")
        return read(hint, value, key)  # pyright: ignore[reportArgumentType]
    if origin is Literal:
        if value not in get_args(hint):
            options = ", ".join(repr(a) for a in get_args(hint))
            meant = did_you_mean(str(value), [str(a) for a in get_args(hint)])
            suggestion = f";{meant}" if meant else ""
            raise ConfigurationError(f"{key} = {value!r} is not one of {options}{suggestion}")
        return value
    if origin is dict:
        return _table(get_args(hint)[1], value, key)
    if origin is tuple:
        return _tuple(get_args(hint), bounds, value, key)
    return _scalar(hint, bounds, value, key)


def _table(hint: Any, value: Any, key: str) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise ConfigurationError(f"{key} must hold tables, got {value!r}; write [{key}.NAME]")
    return {name: _value(hint, item, f"{key}.{name}") for name, item in value.items()}


def _tuple(items: tuple[Any, ...], bounds: Bounds | None, value: Any, key: str) -> Any:
    if not isinstance(value, list):
        raise ConfigurationError(f"{key} must be a list, got {value!r}")
    if len(items) == 2 and items[1] is Ellipsis:
        items = (items[0],) * len(value)
    if len(items) != len(value):
        raise ConfigurationError(f"{key} takes {len(items)} values, got {len(value)}: {value!r}")
    hints = [Annotated[i, bounds] if bounds else i for i in items]
    converted = tuple(
        _value(h, v, f"{key}[{k}]") for k, (h, v) in enumerate(zip(hints, value, strict=True))
    )
    if bounds and bounds.min_norm and math.hypot(*converted) < bounds.min_norm:
        raise ConfigurationError(f"{key} = {value} is no direction; give one of length 1")
    return converted


def _scalar(hint: Any, bounds: Bounds | None, value: Any, key: str) -> Any:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if number and not abs(value) <= MAX_NUMBER:
        raise ConfigurationError(f"{key} = {value} must be finite, and within ±{MAX_NUMBER:g}")
    if hint is float and number:
        value = float(value)
    if not isinstance(value, hint) or (hint is int and isinstance(value, bool)):
        raise ConfigurationError(f"{key} = {value!r} must be a {hint.__name__}")
    if isinstance(value, str):
        _check_text(value, key)
    elif bounds and not bounds.low <= value <= bounds.high:
        unit = f" {bounds.unit}" if bounds.unit else ""
        raise ConfigurationError(
            f"{key} = {value}{unit} is out of bounds; "
            f"give a value between {bounds.low:g} and {bounds.high:g}{unit}"
        )
    return value


def _check_text(value: str, key: str) -> None:
    """Check that a text fits messages, terminals and files.

    Raises:
        ConfigurationError: It is too long, or has control characters.
    """
    if len(value) > MAX_TEXT_LENGTH or not is_plain(value):
        raise ConfigurationError(
            f"{key} = {value[:60]!r} has {len(value)} characters; give up to {MAX_TEXT_LENGTH}, "
            "and no control characters"
        )
