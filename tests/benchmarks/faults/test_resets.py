from __future__ import annotations

from benchmarks.faults.resets import ResetSpec, run_and_reset


def test_two_arms_reach_their_goal_again_after_a_reset() -> None:
    trial = run_and_reset(ResetSpec("two-arms", 2, "truth"))
    assert trial.final_states == ["reached", "reached"]
    assert trial.start_error_mm < 2.0
