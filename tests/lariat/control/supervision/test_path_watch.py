"""The arms stop on the way for another path, a few times, then the run fails; its end is judged."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lariat.control.run.reasons import ReasonCode
from lariat.control.run.state_machine import RunState
from lariat.control.supervision.clearance_guard import Threat
from lariat.control.supervision.path_watch import PathWatch
from lariat.geometry.obstacles import TABLE
from lariat.rod import RodProperties
from lariat.scenario.sections.clips import Clip
from lariat.trajectory import SECOND
from tests.lariat.control.supervision.started_run import Run, path


def watch_of(run: Run, *nodes: float) -> PathWatch:
    """Watch of a rope whose path leads to heights above a table."""
    shapes = np.array([[[x, 0.0, z] for x in (0.0, 0.1)] for z in nodes])
    controller = SimpleNamespace(reference=path(), remaining_nodes=shapes)
    scene = SimpleNamespace(still=(TABLE,))
    parts: Any = (run.task, None, scene, controller, run.progress, None, run.replanning, run.paths)
    return PathWatch(*parts)


def test_expected_contacts_are_planned_again_then_end_the_run_with_what_it_needs(
    run: Run,
) -> None:
    threat = Threat("post", 0.021, -0.003, 0.004, 0.007, 0.010)
    asked = run.task.replan_count
    for k in range(1, 5):
        reason = watch_of(run).threatened(threat, -0.0048)
        assert reason.code is ReasonCode.APPROACHING_OBSTACLE
        assert (run.task.state, run.task.replan_count) == (RunState.RUNNING, asked + k)
    watch_of(run).threatened(threat, -0.0048)
    assert (run.task.state, run.task.reason.code) == (RunState.FAILED, ReasonCode.CONTACT_EXPECTED)
    text = str(run.task.reason)
    assert "21.0 mm" in text
    assert "'post'" in text
    assert "12 mm" in text


def test_wrong_predictions_need_a_more_careful_path_twice(run: Run) -> None:
    assert not watch_of(run).unforeseen(0.014)
    assert [watch_of(run).unforeseen(0.016) for _ in range(3)] == [True, True, False]
    assert run.task.state is RunState.RUNNING
    assert run.task.pace == pytest.approx(0.36)
    assert run.task.clearance_margin == 0.02


@pytest.mark.parametrize(
    ("error", "leaning", "stops"),
    [(0.02, False, True), (0.02, True, False), (0.004, False, False)],
    ids=["on its way", "on a support", "within tolerance"],
)
def test_a_rope_on_a_support_or_at_its_goal_keeps_its_path_though_it_was_predicted_elsewhere(
    run: Run, error: float, leaning: bool, stops: bool
) -> None:
    watch: Any = watch_of(run)
    estimator = SimpleNamespace(leaning=leaning, nodes=None)
    watch._rope = SimpleNamespace(
        predictions=SimpleNamespace(deviation=0.016), observed=None, estimator=estimator
    )
    watch._controller.at_end, watch._controller.limits = False, SimpleNamespace(tension=None)
    watch._guard = SimpleNamespace(check=lambda *_: None)
    watch._scene = SimpleNamespace(avoided=(), goal_clearance=lambda _: np.inf)
    run.progress.error, run.progress.tolerance = error, 0.005
    command: Any = SimpleNamespace(plan=SimpleNamespace(nodes=None))
    assert watch.must_stop(command) is stops


def test_obstacle_in_the_rest_of_the_path_needs_another_one(run: Run) -> None:
    before, radius = run.task.replan_count, run.progress.radius
    watch_of(run, 0.1, *[0.3] * 4, radius + 0.006).review_scene()
    assert run.task.replan_count == before
    watch_of(run, 0.1, *[0.3] * 4, radius + 0.004).review_scene()
    assert run.task.replan_count == before + 1


@pytest.mark.parametrize(
    ("limit", "pulled"), [(None, False), (2.1, False), (1.9, True)], ids=["none", "below", "above"]
)
def test_a_rope_that_is_pulled_more_than_the_limit_ends_the_run(
    run: Run, limit: float | None, pulled: bool
) -> None:
    watch: Any = watch_of(run)
    properties = RodProperties(0.4, 0.008, 0.044, 1e6, stretch_stiffness=2000.0)
    watch._controller.limits = SimpleNamespace(tension=limit)
    # One of its edges of 0.1 m is 0.1 mm too long: 2 N.
    nodes = np.zeros((5, 3))
    nodes[:, 0] = [0.0, 0.1, 0.2001, 0.3, 0.4]
    nodes[3:, 0] += 0.0001
    model = SimpleNamespace(
        rod=SimpleNamespace(properties=properties), state=SimpleNamespace(positions=nodes)
    )
    watch._rope = SimpleNamespace(estimator=model)
    assert watch.pulled() is pulled
    assert (run.task.state is RunState.FAILED) is pulled
    if pulled:
        assert run.task.reason.code is ReasonCode.PULLED
        assert "2.00 N" in str(run.task.reason)


def test_reached_run_ends_when_the_rope_leaves_the_goal_while_the_arms_hold(
    run: Run,
) -> None:
    watch = watch_of(run)
    run.progress.at_goal = True
    watch.judge(3 * SECOND, path(), at_end=True)
    assert run.task.reason.code is ReasonCode.SETTLED
    run.progress.error = 0.008
    watch.released()
    assert run.task.state is RunState.REACHED
    run.progress.error = 0.010
    watch.released()
    assert (run.task.state, run.task.reason.code) == (RunState.IDLE, ReasonCode.LEFT_GOAL)


def test_reached_run_ends_when_control_does_not_lead_the_rope_back(run: Run) -> None:
    watch = watch_of(run)
    run.progress.at_goal = True
    watch.judge(3 * SECOND, path(), at_end=True)
    run.progress.at_goal, run.progress.error = False, 0.010
    watch.judge(4 * SECOND, path(), at_end=True)
    watch.judge(9 * SECOND, path(), at_end=True)
    assert run.task.state is RunState.REACHED
    watch.judge(9 * SECOND + 1, path(), at_end=True)
    assert (run.task.state, run.task.reason.code) == (RunState.IDLE, ReasonCode.LEFT_GOAL)


def test_stalled_run_asks_for_two_paths_then_fails(run: Run) -> None:
    watch = watch_of(run)
    now = 2 * SECOND
    for expected in (1, 2):
        watch.judge(now, path(), at_end=True)
        now += 5 * SECOND + 1
        watch.judge(now, path(), at_end=True)
        assert run.task.replan_count == expected
    watch.judge(now, path(), at_end=True)
    watch.judge(now + 5 * SECOND + 1, path(), at_end=True)
    assert (run.task.state, run.task.reason.code) == (RunState.FAILED, ReasonCode.STALLED)


@pytest.mark.parametrize("height", [0.005, 0.05])
def test_cable_that_stalls_in_all_its_clips_is_not_laid_anew(run: Run, height: float) -> None:
    watch: Any = watch_of(run)
    nodes = np.array([[x, 0.0, height] for x in (-0.1, 0.0, 0.1)])
    watch._rope = SimpleNamespace(estimator=SimpleNamespace(nodes=nodes))
    clip = Clip("clip", (0.0, 0.0, 0.0), 0.01, 0.02)
    watch._scene = SimpleNamespace(obstacles=clip.bodies)
    run.task.goal = replace(run.task.goal, route=("clip",))
    watch.judge(2 * SECOND, path(), at_end=True)
    watch.judge(7 * SECOND + 1, path(), at_end=True)
    laid = height < 0.02
    assert (run.task.state is RunState.FAILED) == laid
    assert ("in all clips" in str(run.task.reason)) == laid
    assert run.task.replan_count == (not laid)


def test_rope_at_rest_at_the_end_of_a_path_that_ends_short_fails(run: Run) -> None:
    watch = watch_of(run)
    run.progress.at_rest = run.progress.without_progress = True
    short = path(reached=False)
    watch.judge(2 * SECOND, short, at_end=True)
    assert run.task.state is RunState.RUNNING
    watch.judge(4 * SECOND, short, at_end=True)
    assert run.task.reason.code is ReasonCode.PATH_ENDS_SHORT
    assert str(run.task.reason) == "blocked"


def test_nothing_is_judged_before_the_end_of_the_path(run: Run) -> None:
    watch = watch_of(run)
    run.progress.at_goal = True
    watch.judge(60 * SECOND, path(), at_end=False)
    assert run.task.state is RunState.RUNNING
