"""A run is reached, asks for another path, or fails at the end of its path."""

from __future__ import annotations

from lariat.control.run.reasons import ReasonCode
from lariat.control.run.state_machine import RunState
from lariat.control.supervision.run_judge import RunJudge
from lariat.trajectory import SECOND
from tests.lariat.control.supervision.started_run import Run, path


def test_reached_run_ends_when_the_rope_leaves_the_goal_while_the_arms_hold(
    run: Run,
) -> None:
    judge = RunJudge(run.task, run.progress, run.replanning, run.paths)
    run.progress.at_goal = True
    judge.judge(3 * SECOND, path(), at_end=True)
    assert run.task.reason.code is ReasonCode.SETTLED
    run.progress.error = 0.008
    judge.released()
    assert run.task.state is RunState.REACHED
    run.progress.error = 0.010
    judge.released()
    assert (run.task.state, run.task.reason.code) == (RunState.IDLE, ReasonCode.LEFT_GOAL)


def test_stalled_run_asks_for_two_paths_then_fails(run: Run) -> None:
    judge = RunJudge(run.task, run.progress, run.replanning, run.paths)
    now = 2 * SECOND
    for expected in (1, 2):
        judge.judge(now, path(), at_end=True)
        now += 5 * SECOND + 1
        judge.judge(now, path(), at_end=True)
        assert run.task.replan_count == expected
    judge.judge(now, path(), at_end=True)
    judge.judge(now + 5 * SECOND + 1, path(), at_end=True)
    assert (run.task.state, run.task.reason.code) == (RunState.FAILED, ReasonCode.STALLED)


def test_rope_at_rest_at_the_end_of_a_path_that_ends_short_fails(run: Run) -> None:
    judge = RunJudge(run.task, run.progress, run.replanning, run.paths)
    run.progress.at_rest = run.progress.without_progress = True
    short = path(reached=False)
    judge.judge(2 * SECOND, short, at_end=True)
    assert run.task.state is RunState.RUNNING
    judge.judge(4 * SECOND, short, at_end=True)
    assert run.task.reason.code is ReasonCode.PATH_ENDS_SHORT
    assert str(run.task.reason) == "blocked"


def test_nothing_is_judged_before_the_end_of_the_path(run: Run) -> None:
    judge = RunJudge(run.task, run.progress, run.replanning, run.paths)
    run.progress.at_goal = True
    judge.judge(60 * SECOND, path(), at_end=False)
    assert run.task.state is RunState.RUNNING
