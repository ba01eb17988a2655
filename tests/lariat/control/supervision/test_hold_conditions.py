"""The arms hold for the task, for themselves, and for a rope that is not seen."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import pytest

from lariat.control.run.arm_condition import ArmCondition
from lariat.control.run.reasons import ReasonCode
from lariat.control.run.state_machine import RunState
from lariat.control.supervision.path_watch import PathWatch
from lariat.trajectory import SECOND
from tests.lariat.control.supervision.started_run import Run, code_of, path

ARMS = ArmCondition(True, True, "", 0, 0, "")
REFUSING = replace(ARMS, refused_chunks=26, refusal="joint_limits")
NOW = 2 * SECOND + 1


def reason_of(
    run: Run,
    arms: ArmCondition = ARMS,
    last_seen: int | None = 2 * SECOND,
    p_wrong: float = 0.0,
    tracking_error: float = 0.0,
    *,
    following: bool = False,
) -> ReasonCode | None:
    predictions = SimpleNamespace(max_deviation=0.0)
    rope: Any = SimpleNamespace(last_seen=last_seen, p_wrong=p_wrong, predictions=predictions)
    controller: Any = SimpleNamespace(
        reference=path() if following else None, tracking_error=lambda: tracking_error
    )
    parts: Any = (run.task, rope, None, controller, run.progress, None, run.replanning, run.paths)
    return code_of(PathWatch(*parts).hold_reason(arms, NOW))


def test_arms_hold_for_the_task_the_arms_and_a_rope_that_is_not_seen(run: Run) -> None:
    reason = partial(reason_of, run)
    assert reason() is None
    assert reason(replace(ARMS, available=False)) is ReasonCode.ARMS_UNAVAILABLE
    assert reason(replace(ARMS, reset_count=1)) is ReasonCode.WAITING_FOR_RESET
    assert reason(last_seen=None) is ReasonCode.ROPE_NOT_SEEN
    assert reason(last_seen=SECOND) is ReasonCode.ROPE_NOT_SEEN
    assert reason(last_seen=SECOND, p_wrong=0.02) is ReasonCode.ROPE_NOT_SEEN
    assert reason(last_seen=SECOND, p_wrong=0.6) is ReasonCode.ROPE_DOUBTFUL
    assert reason(p_wrong=0.6) is None
    run.task.pause()
    assert reason() is ReasonCode.PAUSE_REQUESTED


def test_rope_that_is_lost_under_way_needs_another_path(run: Run) -> None:
    before = run.task.replan_count
    reason_of(run, last_seen=None)
    assert run.task.replan_count == before
    reason_of(run, last_seen=None, following=True)
    assert run.task.replan_count == before + 1


def test_refused_paths_are_planned_again_with_more_clearance_and_less_speed(
    run: Run,
) -> None:
    asked = run.task.replan_count
    margins, paces = [], []
    for k in range(1, 4):
        reason_of(run, REFUSING, following=True)
        assert (run.task.state, run.task.replan_count) == (RunState.RUNNING, asked + k)
        margins.append(run.task.clearance_margin)
        paces.append(run.task.pace)
    assert margins == pytest.approx([0.003, 0.006, 0.009])
    assert paces == pytest.approx([0.6, 0.36, 0.216])
    reason_of(run, REFUSING, following=True)
    assert (run.task.state, run.task.replan_count) == (RunState.FAILED, asked + 3)
    assert run.task.reason.code is ReasonCode.PATH_NOT_FOLLOWED
    assert "joint_limits" in str(run.task.reason)
    run.replanning.begin_run()
    assert (run.task.clearance_margin, run.task.pace) == (0.0, 1.0)
    run.task.start(2)
    reason_of(run, REFUSING, following=True)
    assert run.task.state is RunState.RUNNING


def test_few_refusals_and_small_tracking_errors_are_no_reason(run: Run) -> None:
    few = replace(REFUSING, refused_chunks=25)
    assert reason_of(run, few, tracking_error=0.04, following=True) is None
    assert reason_of(run, REFUSING) is None
    reason = reason_of(run, tracking_error=0.041, following=True)
    assert reason is ReasonCode.ARM_OFF_COURSE
