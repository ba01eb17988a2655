"""The paper's real experiments: their beliefs and tables."""

from __future__ import annotations

import pytest

from benchmarks.campaign import Trial
from benchmarks.paper.real import PAPER_ERRORS, Experiment, table_2, table_3


def finished(rope: str, goal: int, error_mm: float, reached_s: float | None = 2.0) -> Trial:
    return {
        "spec": Experiment(rope, goal, 4.0, True),
        "error_mm": error_mm,
        "min_clearance_mm": 12.0,
        "reached_s": reached_s,
        "believed_stiffness": 8e-4,
        "found_stiffness": (1.8e-4, 0.1e-4),
        "true_stiffness": 2e-4,
    }


@pytest.mark.parametrize("rope", PAPER_ERRORS)
def test_controller_believes_a_multiple_of_the_true_stiffness(rope: str) -> None:
    cell = Experiment(rope, 2, 4.0, False).scenario
    assert cell.rope.youngs_modulus == pytest.approx(4.0 * cell.plant_rope.youngs_modulus)
    assert cell.sensing.source == "camera"
    assert not cell.control.adapt


@pytest.mark.parametrize("last", [4.0, None])
def test_a_row_averages_its_goals(last: float | None) -> None:
    runs = [finished("rope", 1, 0.1), finished("rope", 2, 0.2), finished("rope", 3, 0.6, last)]
    row, paper, *_ = table_3(runs)
    assert [row[f"goal {k}"] for k in (1, 2, 3)] == [0.1, 0.2, 0.6]
    assert row["average"] == pytest.approx(0.3)
    assert row["longest time to goal [s]"] == last
    assert (paper["goal 3"], paper["average"]) == (9.0, pytest.approx(38.0 / 3.0))


def test_a_stiffness_is_compared_with_the_true_one() -> None:
    (row,) = table_2([finished("rope", 1, 0.1)])
    assert row["adapted EI [N m²]"] == "(1.80 ± 0.10)e-4"
    assert row["adapted / true − 1"] == "-10 %"
