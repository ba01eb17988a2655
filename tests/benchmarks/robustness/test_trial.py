from __future__ import annotations

import json as encoder
import math
from pathlib import Path

import pytest

from benchmarks.campaign import CampaignOptions, Trial
from benchmarks.robustness import bench
from benchmarks.robustness.bench import faults, is_near, row, summary
from benchmarks.robustness.combinations import Combination, sample
from lariat.configuration import ConfigurationError

GOOD: Trial = {
    "spec": sample(0, 3),
    "commit": "abc",
    "error_mm": 0.2,
    "shape_error_mm": 0.1,
    "min_clearance_mm": 9.0,
    "touched": False,
    "gave_up": False,
    "leans": False,
    "stiffness": 1.05,
    "stiffness_deviation": 0.05,
    "stiffness_bound": 0.02,
    "place_bound_mm": 0.6,
    "noise_ratio": 1.5,
    "reason": "the time limit has passed",
}


def test_a_run_is_judged_by_error_contact_and_stiffness() -> None:
    assert faults(GOOD) == []
    far = {**GOOD, "error_mm": 1.5, "shape_error_mm": 1.2}
    assert faults(far) == ["1.50 mm off"]
    assert faults({**far, "leans": True}) == []
    assert faults({**GOOD, "touched": True}) == ["touched"]
    stiff = {**GOOD, "stiffness": 1.4}
    assert "1.40" in faults(stiff)[0]
    assert len(faults(stiff)) == 1
    # Where the shapes do not tell it, the stiffness is not asked for.
    assert faults({**stiff, "stiffness_bound": 0.2}) == []
    lost = {**GOOD, "error_mm": math.inf, "stiffness": math.nan}
    assert not is_near(lost)
    assert summary([GOOD, far, lost])["at the goal"] == 1


def test_a_rope_is_at_its_goal_where_only_its_place_along_itself_is_off_and_cannot_be_seen() -> (
    None
):
    shifted = {**GOOD, "error_mm": 1.5}
    assert is_near(shifted)
    assert summary([shifted])["nodes at the goal"] == 0
    # Less than (1 + (2 * 0.2)^2)^(1/2) mm cannot be seen.
    assert not is_near({**shifted, "place_bound_mm": 0.2})
    assert not is_near({**shifted, "shape_error_mm": math.nan})


def test_a_run_without_adaptation_may_give_up_but_not_miss_its_goal_silently() -> None:
    combination = sample(0, 3, adapts=False)
    missed = {**GOOD, "spec": combination, "error_mm": 40.0}
    assert faults(missed) == ["40.00 mm off"]
    assert faults({**missed, "gave_up": True}) == []
    assert faults({**missed, "gave_up": True, "touched": True}) == ["touched"]
    wrong = {**GOOD, "spec": combination, "stiffness": 2.1}
    assert faults(wrong) == []


def test_table_lists_every_run_with_what_it_missed() -> None:
    rows = [row(GOOD), row({**GOOD, "error_mm": 3.0, "stiffness_bound": 0.2})]
    assert [(r["no."], r["missed"]) for r in rows] == [(3, ""), (3, "3.00 mm off")]
    assert [r["EI found / true"] for r in rows] == ["1.05 ± 0.05", "(1.05 ± 0.05)"]


def test_a_combination_that_cannot_be_run_does_not_end_the_campaign(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def attempt(folder: Path, combination: Combination) -> Trial:
        if combination.number == 3:
            raise ConfigurationError("cannot be run: its goal is inside an obstacle")
        return {**GOOD, "spec": combination}

    monkeypatch.setattr(bench, "run_trial", attempt)
    assert bench.run(only=(3, 4), folder=tmp_path, options=CampaignOptions(json=True)) == 1
    out, err = capsys.readouterr()
    assert [r["value"] for r in encoder.loads(out)["summary"] if r["measure"] == "good"] == [1]
    assert "goal is inside an obstacle" in " ".join(err.split())
