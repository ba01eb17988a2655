"""Calibration of the clearance that paths keep with 99 %."""

from __future__ import annotations

import pytest

from benchmarks.goals.clearance import ClearanceSpec, run_trial, summary


def test_bound_of_none_that_came_closer_is_the_root_of_five_percent() -> None:
    trial = {"ropes": 149, "closer": 0, "clearance_mm": 12.0, "certain_clearance_mm": 8.0}
    found = summary("hard", [trial])
    assert (found["paths"], found["ropes"], found["rate"]) == (1, 149, 0.0)
    assert found["rate_upper_95"] == pytest.approx(1.0 - 0.05 ** (1.0 / 149.0))
    more = summary("hard", [trial, {**trial, "closer": 3, "certain_clearance_mm": 6.0}])
    assert (more["closer"], more["certain_clearance_mm"]) == (3, 7.0)
    assert more["rate_upper_95"] > 3.0 / 298.0


def test_finer_ropes_that_are_driven_along_a_path_scatter() -> None:
    trial = run_trial(ClearanceSpec("hard", 0, 0, 6))
    assert trial["certain_clearance_mm"] < trial["clearance_mm"] - 2.0
    assert trial["ropes"] == 6
    assert max(trial["least_mm"]) - min(trial["least_mm"]) > 0.5
    assert trial["closer"] == sum(c < trial["certain_clearance_mm"] for c in trial["least_mm"])
