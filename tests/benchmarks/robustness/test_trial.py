from __future__ import annotations

import csv
import json as encoder
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.robustness import bench
from benchmarks.robustness.bench import summary
from benchmarks.robustness.combinations import Combination, sample
from benchmarks.robustness.tables import write_table
from benchmarks.robustness.trial import Trial
from lariat.configuration import ConfigurationError

SCORE = {
    "final_error_mm": 0.2,
    "final_shape_error_mm": 0.1,
    "contact_time_s": 0.0,
    "min_clearance_mm": 9.0,
    "horizon_error_mm": 1.5,
    "sensing_error_mm": 1.0,
    "parameters": {"bending_stiffness": [2.1e-4, 1e-5]},
}
GOOD = Trial(
    sample(0, 3),
    "abc",
    SCORE,
    "the time limit has passed",
    False,
    False,
    15.0,
    2e-4,
    0.02,
    0.6,
)


def test_a_run_is_judged_by_error_contact_and_stiffness() -> None:
    assert GOOD.faults == []
    far = replace(GOOD, score=SCORE | {"final_error_mm": 1.5})
    assert far.faults == ["1.50 mm off"]
    assert replace(far, leans=True).faults == []
    assert replace(GOOD, score=SCORE | {"contact_time_s": 0.1}).faults == ["touched"]
    stiff = replace(GOOD, true_stiffness=1.5e-4)
    assert stiff.faults == ["stiffness 1.40 of the true one"]
    # Where the shapes do not tell it, the stiffness is not asked for.
    assert replace(stiff, stiffness_bound=0.2).faults == []
    lost = replace(GOOD, score=SCORE | {"final_error_mm": None, "parameters": {}})
    assert not lost.near
    assert summary([GOOD, far, lost])["at the goal"] == 1


def test_a_run_without_adaptation_may_give_up_but_not_miss_its_goal_silently() -> None:
    combination = sample(0, 3, adapts=False)
    missed = replace(GOOD, spec=combination, score=SCORE | {"final_error_mm": 40.0})
    assert missed.faults == ["40.00 mm off"]
    assert replace(missed, stopped=True).faults == []
    assert replace(missed, stopped=True, score=missed.score | {"contact_time_s": 0.1}).touched
    wrong = replace(GOOD, spec=combination, true_stiffness=1.0e-4)
    assert wrong.faults == []


def test_table_lists_every_run_with_what_it_missed(tmp_path: Path) -> None:
    far = replace(GOOD, score=SCORE | {"final_error_mm": 1.5})
    table = tmp_path / "results" / "table.csv"
    write_table(table, [GOOD, far], [sample(0, 3)] * 2)
    with table.open() as stream:
        rows = list(csv.DictReader(stream))
    assert [(row["no."], row["missed"]) for row in rows] == [("3", ""), ("3", "1.50 mm off")]


def test_a_combination_that_cannot_be_run_does_not_end_the_campaign(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def attempt(folder: Path, combination: Combination) -> Trial:
        if combination.number == 3:
            raise ConfigurationError("cannot be run: its goal is inside an obstacle")
        return replace(GOOD, spec=combination)

    monkeypatch.setattr(bench, "run_trial", attempt)
    assert bench.run(only=(3, 4), folder=tmp_path, json=True) == 1
    out, err = capsys.readouterr()
    assert encoder.loads(out)["summary"]["good"] == 1
    assert "cannot be run: its goal is inside an obstacle" in " ".join(err.split())
