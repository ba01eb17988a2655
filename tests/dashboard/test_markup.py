"""Walk over the source of the page: no text enters HTML but through `escaped`."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import dashboard
from dashboard.markup import escaped, text_html

FILES = sorted(Path(dashboard.__file__).parent.rglob("*.py"))
SINKS = {"add_markdown", "add_command", "run_javascript", "add_plotly"}
"""Methods of viser that interpret what they get."""
NOTIFIER = "site.py"
"""The only file that notifies; it makes texts plain."""
TAG = re.compile(r"</?[a-z]|&[a-z]+;")
STYLES = {"css", "text_css"}
"""Functions that return a colour of the palette."""
STYLE_NAMES = {"style", "margin", "size", "height", "weight"}
"""Arguments that hold the page's own layout."""
NUMBER = re.compile(r"[dfge%S]$")
"""Format of a number or a time, in which no text fits."""


def is_markup(node: ast.expr) -> bool:
    """Whether an f-string has a tag of its own."""
    parts = node.values if isinstance(node, ast.JoinedStr) else ()
    return any(isinstance(p, ast.Constant) and TAG.search(str(p.value)) for p in parts)


class Function:
    """Function or module, with the values that its names get."""

    def __init__(self, node: ast.AST) -> None:
        self._values: dict[str, list[ast.expr]] = {}
        for part in ast.walk(node):
            match part:
                case ast.Assign(targets=[target], value=value):
                    self._assign(target, value)
                case ast.AnnAssign(target=target, value=ast.expr() as value):
                    self._assign(target, value)
                case ast.AugAssign(target=ast.Name(name), value=value):
                    self._values.setdefault(name, []).append(value)
                case ast.Call(func=ast.Attribute(ast.Name(name), "append"), args=[value]):
                    self._values.setdefault(name, []).append(value)

    def _assign(self, target: ast.expr, value: ast.expr) -> None:
        match target, value:
            case ast.Name(name), _:
                self._values.setdefault(name, []).append(value)
            case ast.Tuple(targets), ast.Tuple(values):
                for each, its in zip(targets, values, strict=True):
                    self._assign(each, its)

    def is_safe(self, node: ast.expr, seen: frozenset[str] = frozenset()) -> bool:
        """Whether an expression holds no text that has not been escaped."""

        def safe(part: ast.expr) -> bool:
            return self.is_safe(part, seen)

        match node:
            case ast.Constant():
                return True
            case ast.JoinedStr(values):
                return all(map(safe, values))
            case ast.FormattedValue(format_spec=ast.JoinedStr([ast.Constant(str(spec))])):
                return NUMBER.search(spec) is not None
            case ast.FormattedValue(value):
                return safe(value)
            case ast.IfExp(_, body, other):
                return safe(body) and safe(other)
            case ast.BinOp(left, ast.Mult(), _):
                return safe(left)
            case ast.BinOp(left, ast.Add(), right):
                return safe(left) and safe(right)
            case ast.BoolOp(_, values) | ast.List(values):
                return all(map(safe, values))
            case ast.Starred(value):
                return safe(value)
            case ast.GeneratorExp(element) | ast.ListComp(element):
                return safe(element)
            case ast.Call(ast.Attribute(separator, "join"), [items]):
                return safe(separator) and safe(items)
            case ast.Subscript(ast.Dict(_, values)):
                return all(map(safe, values))
            case ast.Call(ast.Name(name) | ast.Attribute(_, name)):
                return name in STYLES or name == "escaped" or name.endswith("_html")
            case ast.Name(name):
                if name.isupper() or name in seen or name.endswith("_html"):
                    return True
                values = self._values.get(name, [])
                given = all(self.is_safe(v, seen | {name}) for v in values)
                return given and (bool(values) or name in STYLE_NAMES)
        return False


def functions(tree: ast.Module) -> Iterator[ast.AST]:
    yield from (n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef))


def leaks(tree: ast.Module) -> list[str]:
    """Places where a text enters HTML unescaped, or a sink that interprets it."""
    found = []
    for node in functions(tree):
        function = Function(node)
        for part in ast.walk(node):
            match part:
                case ast.JoinedStr() if is_markup(part) and not function.is_safe(part):
                    found.append(f"{part.lineno}: {ast.unparse(part)[:80]}")
                case ast.Call(ast.Attribute(_, name)) if name in SINKS:
                    found.append(f"{part.lineno}: {name}")
    return found


def test_notifications_leave_by_one_door() -> None:
    assert [f.name for f in FILES if ".add_notification(" in f.read_text()] == [NOTIFIER]


@pytest.mark.parametrize("file", FILES, ids=lambda f: str(f.name))
def test_every_text_is_escaped_where_it_enters_html(file: Path) -> None:
    assert leaks(ast.parse(file.read_text())) == []


@pytest.mark.parametrize(
    "line",
    [
        "gui.add_html(f'<b>{name}</b>')",
        "text = name; gui.add_html(f'<b>{text}</b>')",
        "rows = [f'<td>{n}</td>' for n in names]; gui.add_html(''.join(rows))",
        "rows = []; rows.append(name); gui.add_html(f'<b>{\"\".join(rows)}</b>')",
        "gui.add_markdown('text')",
    ],
)
def test_walk_finds_a_text_that_is_not_escaped(line: str) -> None:
    assert leaks(ast.parse(f"def f(gui, name, names):\n    {line}"))


def test_html_shows_a_text_as_it_is() -> None:
    assert escaped("<iframe srcdoc=x>\x1b") == r"&lt;iframe srcdoc=x&gt;\x1b"
    assert text_html("`<b>` & so") == "<code>&lt;b&gt;</code> &amp; so"
