"""Statistics of the goals bench."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from benchmarks.goals.bench import summary
from stack.simulation.score import Score

SCORE = {field.name: None for field in fields(Score)} | {
    "final_error_mm": 0.5,
    "contact_time_s": 0.0,
    "length_error_mm": 0.1,
    "plan_ms": {"p50": 1.0, "p99": 2.0},
    "replans": 1,
}
MOTION = dict.fromkeys(("speed", "acceleration", "grip_distance", "longest_stop"), 0.5)


def trial(succeeded: bool = True, **score: Any) -> dict[str, Any]:
    figures = {"succeeded": succeeded, "plan_s": [0.5], "gripper_clearance_mm": 50.0}
    return {**MOTION, **figures, "score": SCORE | score}


def test_errors_contacts_and_times_are_counted_where_they_are_known() -> None:
    trials = [
        trial(reached_s=2.0),
        trial(final_error_mm=4.0, reached_s=3.0),
        trial(False, contact_time_s=0.1),
        trial(False, final_error_mm=None),
    ]
    found = summary(trials)
    assert (found["trials"], found["succeeded"], found["touched"]) == (4, 2, 1)
    assert (found["error below 1 mm"], found["error below 5 mm"]) == (2, 3)
    assert found["largest error [mm]"] == float("inf")
    assert found["median time to goal [s]"] == 2.5
    assert found["replans"] == 4
