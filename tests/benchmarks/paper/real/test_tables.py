"""Tables of the paper's real experiments."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from benchmarks.paper.real.experiments import Experiment
from benchmarks.paper.real.tables import PAPER_ERRORS, table_2, table_3
from benchmarks.result_block import markdown

PAGE = Path(__file__).parents[4] / "docs" / "results" / "real" / "tables.md"


def finished(rope: str, goal: int, error_mm: float, reached_s: float | None = 2.0):
    score = SimpleNamespace(final_error_mm=error_mm, reached_s=reached_s, min_clearance_mm=12.0)
    return SimpleNamespace(
        experiment=Experiment(rope, goal, 4.0, adapt=True),
        score=score,
        adapted_stiffness=(1.8e-4, 0.1e-4),
        believed_stiffness=8e-4,
        true_stiffness=2e-4,
    )


def rows(text: str, begin: str) -> list[list[str]]:
    lines = [line for line in text.splitlines() if line.startswith(begin)]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def test_the_page_has_the_heads_of_the_tables():
    page = PAGE.read_text()
    for table in (table_3([], "conditions"), table_2([])):
        title, _, head = markdown(table).splitlines()[:3]
        assert title in page
        assert head in page


@pytest.mark.parametrize(("last", "slowest"), [(4.0, "4.0 s"), (None, "not all")])
def test_a_row_averages_its_goals(last: float | None, slowest: str):
    runs = [finished("rope", 1, 0.1), finished("rope", 2, 0.2), finished("rope", 3, 0.6, last)]
    text = markdown(table_3(runs, "conditions"))  # pyright: ignore[reportArgumentType]
    (row,) = rows(text, "| rope |")
    assert row == ["rope", "× 4", "yes", "0.10", "0.20", "0.60", "0.30", slowest, "12.0 mm"]
    (paper,) = rows(text, "| rope, paper |")
    assert paper[3:6] == [f"{e:.0f}" for e in PAPER_ERRORS["rope"]]


def test_a_stiffness_is_compared_with_the_true_one():
    text = markdown(table_2([finished("rope", 1, 0.1)]))  # pyright: ignore[reportArgumentType]
    (row,) = rows(text, "| rope, goal 1 |")
    assert row[2:] == ["(1.80 ± 0.10)e-4", "2.00e-04", "-10 %"]
