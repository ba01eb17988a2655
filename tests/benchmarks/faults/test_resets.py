from __future__ import annotations

from pathlib import Path

from benchmarks.faults.resets import run_and_reset
from stack.scenario_overrides import load_with


def test_two_arms_reach_their_goal_again_after_a_reset() -> None:
    scenario = load_with(Path("two-arms"), ("sensing.source=truth",))
    trial = run_and_reset(scenario, runs=2)
    assert trial.final_states == ["reached", "reached"]
    assert trial.start_error_mm < 2.0
