"""Tables that benches write into pages of the documentation."""

from __future__ import annotations

import importlib
import json
import shlex
from dataclasses import dataclass
from pathlib import Path

import pytest
import tyro
from rich.table import Table

from benchmarks.benches import BENCHES, find
from benchmarks.result_block import BLOCK, find_block, markdown, report
from lariat.configuration import ConfigurationError

DOCS = Path(__file__).parents[2] / "docs"
BLOCKS = [
    pytest.param(page, words, content, id=words)
    for page in sorted(DOCS.rglob("*.md"))
    for words, content in BLOCK.findall(page.read_text())
]


@dataclass(frozen=True)
class Spec:
    name: str


@dataclass(frozen=True)
class Row:
    spec: Spec
    errors_mm: list[float]
    held: bool
    reached: bool | None


def table() -> Table:
    found = Table("what", r"error \[mm]", title="Two | rows", caption="plant: rod, n = 118")
    found.columns[1].justify = "right"
    found.add_row("[red]straight[/red]", "0.12")
    found.add_row("a < b", r"\[0.5]")
    return found


def test_markdown_has_every_cell_without_markup():
    assert markdown(table()).splitlines() == [
        "**Two \\| rows**",
        "",
        "| what | error [mm] |",
        "| --- | ---: |",
        "| straight | 0.12 |",
        "| a &lt; b | [0.5] |",
        "",
        "plant: rod, n = 118",
    ]


def test_a_command_replaces_its_own_block_alone(tmp_path: Path):
    page = tmp_path / "control.md"
    page.write_text(
        "# Control\n\n<!-- lariat bench goals --count 3 -->\nold\n<!-- /lariat -->\n\ntext\n\n"
        "<!-- lariat bench goals --count 30 -->\nother\n<!-- /lariat -->\nend\n"
    )
    block = find_block(tmp_path, ["bench", "goals", "--docs", str(tmp_path), "--count", "3"])
    assert block is not None
    for _ in range(2):
        block.write([table()])
        first, second = BLOCK.findall(page.read_text())
        assert "| straight | 0.12 |" in first[1]
        assert "old" not in first[1]
        assert "Written by `lariat bench goals --count 3`, " in first[1]
        assert second == ("bench goals --count 30", "other\n")
    assert page.read_text().startswith("# Control\n\n<!--")
    assert page.read_text().endswith("<!-- /lariat -->\nend\n")


def test_a_command_without_a_block_is_refused_with_the_lines_to_add(tmp_path: Path):
    with pytest.raises(ConfigurationError, match=r"<!-- lariat bench goals -->.*<!-- /lariat -->"):
        find_block(tmp_path, ["bench", "goals", f"--docs={tmp_path}"])
    assert find_block(None, ["bench", "goals"]) is None


def test_pages_have_blocks():
    assert BLOCKS


@pytest.mark.parametrize(("page", "words", "content"), BLOCKS)
def test_the_block_of_a_page_names_a_command_and_holds_its_tables(
    page: Path, words: str, content: str
):
    name, options = find(shlex.split(words)[1:])
    bench = importlib.import_module(BENCHES[name].module)
    # Parses the words as the command line does; nothing runs.
    tyro.cli(_signature_of(bench.run), args=[*options, "--docs", str(page.parent)])
    assert f"Written by `lariat {words}`, " in content
    rows = [line for line in content.splitlines() if line.startswith("|")]
    assert len(rows) >= 3
    widths = [line.replace("\\|", "").count("|") for line in rows]
    begins = [k for k, line in enumerate(rows) if set(line) <= set("|-: ")]
    assert begins
    for begin, end in zip(begins, [*[b - 1 for b in begins[1:]], len(rows)], strict=True):
        assert set(widths[begin - 1 : end]) == {widths[begin]}


def _signature_of(run):
    """Return a function with the command line of another one, which it does not call."""
    import functools

    @functools.wraps(run)
    def parsed(*arguments, **options):
        return 0

    return parsed


def test_dataclasses_are_rows_of_a_table_and_of_one_json_object(
    capsys: pytest.CaptureFixture[str],
) -> None:
    rows = [Row(Spec("sim"), [0.123456, 2.0], True, None)]
    report(rows, "caption")
    text = capsys.readouterr().out
    for cell in ("name", "sim", "0.1235, 2", "yes", "–", "caption"):
        assert cell in text
    report(rows, json=True)
    row = {"name": "sim", "errors_mm": [0.123456, 2.0], "held": True, "reached": None}
    assert json.loads(capsys.readouterr().out) == {"rows": [row]}
