"""Trials of the goals bench outlive the process that ran them."""

from __future__ import annotations

import json
from dataclasses import asdict, fields, replace

from benchmarks.conditions import Conditions
from benchmarks.goals.trial import Trial, TrialSpec, restore, summary
from stack.simulation.score import Score

SCORE = Score(**{field.name: None for field in fields(Score)})
REACHED = Trial(
    TrialSpec("easy", 3, 7, ("plant.model=rod",)),
    Conditions("rod", "truth", "no"),
    replace(
        SCORE,
        reached=True,
        final_error_mm=0.5,
        contact_time_s=0.0,
        length_error_mm=0.1,
        plan_ms={"p50": 1.0, "p99": 2.0},
        replans=1,
    ),
    "reached",
    gave_up=False,
    plan_s=[0.5],
    speed=0.4,
    acceleration=0.2,
    grip_distance=0.9,
    gripper_clearance_mm=50.0,
    longest_stop=0.0,
    ends=[[[0.0, 0.0, 0.0]]],
)


def test_a_trial_is_restored_from_its_row() -> None:
    row = json.loads(json.dumps(asdict(REACHED)))
    assert restore(**{**row, "spec": REACHED.spec}) == REACHED


def test_a_blocked_scene_asks_to_give_up_and_no_scene_allows_touching() -> None:
    blocked = replace(REACHED, spec=replace(REACHED.spec, kind="blocked"))
    touching = replace(REACHED, score=replace(REACHED.score, contact_time_s=0.1))
    trials = [REACHED, blocked, replace(blocked, gave_up=True), touching]
    assert [trial.succeeded for trial in trials] == [True, False, True, False]
    found = summary([*trials, replace(REACHED, score=replace(REACHED.score, final_error_mm=4.0))])
    assert (found["trials"], found["succeeded"], found["touched"]) == (5, 3, 1)
    assert (found["error below 1 mm"], found["error below 5 mm"]) == (4, 5)
