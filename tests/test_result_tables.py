"""Tables of results: each one says which command measured it.

A table with figures stands below one of two marks:

    <!-- measured 22 November 2026: lariat bench goals --count 24 -->
    <!-- without a command: the data set is not part of the repository -->
"""

from __future__ import annotations

import functools
import re
from pathlib import Path

import pytest

from tests.test_commands import problem

RESULTS = Path(__file__).parents[1] / "docs" / "results"
PAGES = sorted(RESULTS.rglob("*.md"))
MEASURED = re.compile(r"<!-- measured \d{1,2} [A-Z][a-z]+ \d{4}: (lariat .+) -->")
EXCUSED = re.compile(r"<!-- without a command: \S.{20,} -->")
MAX_EXCUSED = 20
"""Largest number of tables that no command measures."""
DEFINITIONS = (
    "| term | meaning |",
    "| quantity | drawn from |",
    "| part of the paper | here |",
    "| in the paper | here |",
    "| | rope | cable |",
    "| what | target | measured | section |",
    "| measurement | plant, sensing, adaptation | result | page |",
)
"""Heads of tables that measure nothing: they define, or sum up the tables that they link."""


def tables(text: str) -> list[tuple[str, str]]:
    """Return every table with figures, and the line above it that is not empty."""
    lines = text.splitlines()
    found = []
    for k in range(1, len(lines)):
        if not (lines[k].startswith("|") and set(lines[k]) <= set("|-: ")):
            continue
        end = next((j for j in range(k, len(lines)) if not lines[j].startswith("|")), len(lines))
        if any(re.search(r"\d", row) for row in lines[k + 1 : end]):
            if lines[k - 1] in DEFINITIONS:
                continue
            above = [line for line in lines[: k - 1] if line.strip()]
            found.append((lines[k - 1], above[-1]))
    return found


@functools.cache
def fault(above: str) -> str:
    """Why the line above a table does not say how the table was measured; empty if it does."""
    if EXCUSED.fullmatch(above):
        return ""
    marked = MEASURED.fullmatch(above)
    if not marked:
        return "no mark above the table"
    commands = [words.removeprefix("lariat ") for words in marked[1].split("; ")]
    return "; ".join(f"{c}: {why}" for c in commands if (why := problem(c)))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(RESULTS)))
def test_every_table_of_results_says_which_command_measured_it(page: Path):
    text = page.read_text()
    found = tables(text)
    assert {head: why for head, above in found if (why := fault(above))} == {}


def test_few_tables_have_no_command():
    excused = sum(len(EXCUSED.findall(page.read_text())) for page in PAGES)
    assert excused <= MAX_EXCUSED


@pytest.mark.parametrize(
    ("above", "why"),
    [
        ("<!-- measured 22 November 2026: lariat bench goals --count 3 -->", ""),
        ("<!-- measured 22 November 2026: lariat bench goals --cuont 3 -->", "refused"),
        ("<!-- measured 22 November 2026: lariat bench goals; lariat bench birds -->", "no bench"),
        ("<!-- measured: lariat bench goals -->", "no mark"),
        ("<!-- without a command: -->", "no mark"),
        ("Errors of 24 runs:", "no mark"),
    ],
)
def test_a_mark_is_judged_by_its_words(above: str, why: str):
    assert (why in fault(above)) if why else (fault(above) == "")


def test_a_table_of_words_needs_no_command():
    text = "# Page\n\n| word | meaning |\n|---|---|\n| rod | model |\n\n| n |\n|---|\n| 40 |\n"
    assert tables(text) == [("| n |", "| rod | model |")]
