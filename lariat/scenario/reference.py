"""Reference of all keys of a scenario file, in Markdown, from the dataclasses.

`python -m lariat.scenario.reference` prints it; the documentation's site has it as a page.
"""

from __future__ import annotations

import ast
import functools
import inspect
import sys
import types
from collections.abc import Iterator
from dataclasses import MISSING, Field, fields, is_dataclass
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from lariat.configuration import Bounds, Extensible
from lariat.scenario import sections
from lariat.scenario.scenario import Scenario

PAGE_HEADER = """# Scenario files

All keys of a scenario file: values, default and meaning, as `python -m lariat.scenario.reference`
prints them. Units are SI, quaternions are wxyz, poses are in the world frame (z up, the table at
z = 0). A file with an unknown key, a value out of bounds or values that
contradict each other is refused before anything moves; `lariat check FILE` names the error.
"""

INTERNAL_FIELDS = ("folder", "text")
"""Fields of `Scenario` that are not keys of a file."""


def reference() -> str:
    """Return the page, in Markdown."""
    return "\n".join([PAGE_HEADER, *_tables(Scenario, "")])


def _tables(kind: type, path: str) -> Iterator[str]:
    hints = get_type_hints(kind, include_extras=True)
    notes = field_notes(kind)
    plain = [f for f in fields(kind) if f.name not in INTERNAL_FIELDS]
    rows: list[str] = []
    nested: list[tuple[type, str]] = []
    for item in plain:
        section = _section(hints[item.name])
        name = f"{path}.{item.name}" if path else item.name
        name += ".NAME" if get_origin(hints[item.name]) is dict else ""
        if section:
            nested.append((section, name))
            continue
        value = _takes(hints[item.name]) + _default(item)
        rows.append(f"* `{item.name}`: {value}. {notes.get(item.name, '')}".rstrip())
    if rows:
        yield f"## {f'`[{path}]`' if path else 'Top level'}\n"
        if path and kind.__doc__ and not kind.__doc__.startswith(kind.__name__ + "("):
            yield " ".join(kind.__doc__.split()) + "\n"
        yield "\n".join(rows) + "\n"
    documented = {sections.Shape: "start", sections.Obstacle: "obstacles"} if path else {}
    for section, name in nested:
        if section in documented:
            yield f"`[{name}]`: same keys as `[{documented[section]}]`.\n"
            continue
        documented[section] = name
        yield from _tables(section, name)


def _section(hint: Any) -> type | None:
    for part in (hint, *get_args(hint)):
        if is_dataclass(part) and not isinstance(part, Bounds | Extensible):
            return part  # pyright: ignore[reportReturnType]
    return None


def _takes(hint: Any) -> str:
    bounds = None
    if get_origin(hint) in (Union, types.UnionType):
        return " or ".join(_takes(a) for a in get_args(hint) if a is not type(None))
    if get_origin(hint) is Annotated:
        hint, bounds = get_args(hint)[:2]
    if get_origin(hint) in (Union, types.UnionType):
        (hint,) = [a for a in get_args(hint) if a is not type(None)]
    if isinstance(bounds, Extensible):
        return ", ".join(f'`"{a}"`' for a in (*bounds.included, "package.module:Class"))
    if get_origin(hint) is Literal:
        return ", ".join(f'`"{a}"`' for a in get_args(hint))
    if get_origin(hint) is tuple:
        items = get_args(hint)
        if items[-1] is Ellipsis:
            return f"list of {_takes(items[0])}"
        inner = Annotated[items[0], bounds] if bounds else items[0]
        return f"{len(items)}× {_takes(inner)}"
    if bounds:
        return f"{bounds.low:g}…{bounds.high:g} {bounds.unit}".strip()
    return {str: "text", bool: "`true`, `false`", int: "whole number", float: "number"}[hint]


def _default(item: Field[Any]) -> str:
    if item.default is MISSING:
        return "; **required**"
    if item.default is None or item.default in ("", ()):
        return ""
    value = item.default
    text = str(value).lower() if isinstance(value, bool) else str(value)
    return f"; `{text.replace('(', '[').replace(')', ']')}`"


def field_notes(kind: type) -> dict[str, str]:
    """Return the docstring after each field of a dataclass, by the field's name."""
    bases = (base for base in reversed(kind.__mro__) if is_dataclass(base))
    nodes = (_class_definitions(base.__module__)[base.__name__] for base in bases)
    notes, last = {}, ""
    for line in (line for node in nodes for line in node.body):
        if isinstance(line, ast.AnnAssign) and isinstance(line.target, ast.Name):
            last = line.target.id
        elif isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant) and last:
            notes[last] = " ".join(str(line.value.value).split())
            last = ""
    return notes


@functools.cache
def _class_definitions(module: str) -> dict[str, ast.ClassDef]:
    """Return the syntax trees of a module's classes, by name."""
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    return {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}


if __name__ == "__main__":
    print(reference(), end="")
