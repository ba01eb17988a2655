"""The answer to the latest request is followed, where it is for this rope as it is known."""

from __future__ import annotations

import numpy as np

from lariat.control.run.reasons import ReasonCode
from lariat.control.run.state_machine import RunState
from lariat.geometry.poses import Pose
from lariat.trajectory import SECOND, MotionState
from tests.lariat.control.supervision.started_run import Run, code_of, path

HERE = MotionState.at_rest(*[Pose(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))] * 2)


def test_only_the_answer_to_the_latest_request_is_followed(run: Run) -> None:
    review = run.paths.review
    assert code_of(review(None, SECOND)) is ReasonCode.WAITING_FOR_PATH
    old = run.offer(replan_count=run.task.replan_count + 1)
    assert code_of(review(old, SECOND)) is ReasonCode.WAITING_FOR_PATH
    assert review(run.offer(), SECOND) is None
    run.paths.follow(run.offer())
    assert run.paths.follows_latest
    run.task.request_path()
    assert not run.paths.follows_latest


def test_path_of_another_rope_or_of_other_motions_is_no_answer(run: Run) -> None:
    other = run.offer(node_count=40)
    assert code_of(run.paths.review(other, SECOND)) is ReasonCode.WAITING_FOR_PATH
    moving = run.choice(obstacles_move=True)
    assert code_of(moving.review(run.offer(), SECOND)) is ReasonCode.WAITING_FOR_PATH
    assert moving.review(run.offer(motion_run_started=SECOND), SECOND) is None


def test_missing_path_ends_the_run_but_one_older_than_it_is_asked_for_again(
    run: Run,
) -> None:
    none = run.offer(found=False, stamp=SECOND - 1, answer="no way")
    assert code_of(run.paths.review(none, SECOND)) is ReasonCode.WAITING_FOR_PATH
    assert run.task.state is RunState.RUNNING
    again = run.offer(found=False, stamp=SECOND - 1, answer="no way")
    assert code_of(run.paths.review(again, SECOND)) is ReasonCode.NO_PATH
    assert (run.task.state, str(run.task.reason)) == (RunState.FAILED, "no way")


def test_run_waits_while_the_material_is_learnt_but_not_for_ever(run: Run) -> None:
    run.task.set("adapt", "true")
    run.material.settled = False
    assert code_of(run.paths.review(run.offer(), 2 * SECOND)) is ReasonCode.LEARNING_MATERIAL
    assert run.paths.review(run.offer(), 4 * SECOND) is None


def test_path_for_another_material_is_planned_again_twice(run: Run) -> None:
    run.task.set("adapt", "true")
    run.material.bending_stiffness = 2.0
    for _ in range(2):
        reason = run.paths.review(run.offer(), 2 * SECOND)
        assert code_of(reason) is ReasonCode.PATH_OUTDATED
    assert run.paths.review(run.offer(), 2 * SECOND) is None


def test_path_that_may_come_too_near_is_not_followed_and_three_more_careful_ones_are_asked_for(
    run: Run,
) -> None:
    paths, asked = run.choice(certain_clearance=0.012), run.task.replan_count
    margins, paces = [], []
    for _ in range(3):
        reason = paths.review(run.offer(certain_clearance=0.007), 2 * SECOND)
        assert code_of(reason) is ReasonCode.CLEARANCE_UNCERTAIN
        margins.append(run.task.clearance_margin)
        paces.append(run.task.pace)
    np.testing.assert_allclose(margins, [0.005, 0.010, 0.015])
    np.testing.assert_allclose(paces, [0.6, 0.36, 0.216])
    assert run.task.replan_count == asked + 3
    assert paths.review(run.offer(certain_clearance=0.0121), 2 * SECOND) is None
    assert code_of(paths.review(run.offer(certain_clearance=0.0119), 2 * SECOND)) is (
        ReasonCode.NO_PATH
    )
    assert run.task.state is RunState.FAILED
    assert "keeps only 11.9 mm" in str(run.task.reason)
    assert "control.certain_clearance = 12 mm" in str(run.task.reason)


def test_clearance_of_a_rope_that_was_not_learnt_yet_is_asked_for_again_without_more_care(
    run: Run,
) -> None:
    paths = run.choice(certain_clearance=0.012)
    run.task.set("adapt", "true")
    run.material.settled = False
    early = run.offer(certain_clearance=0.0)
    assert code_of(paths.review(early, 3 * SECOND)) is ReasonCode.LEARNING_MATERIAL
    run.material.settled = True
    assert code_of(paths.review(early, 3 * SECOND + 1)) is ReasonCode.CLEARANCE_UNCERTAIN
    assert (run.task.clearance_margin, run.task.pace) == (0.0, 1.0)
    before_the_run = run.offer(certain_clearance=0.0, stamp=SECOND - 1)
    run.choice(certain_clearance=0.012).review(before_the_run, 2 * SECOND)
    assert run.task.clearance_margin == 0.0
    late = run.offer(certain_clearance=0.0, stamp=3 * SECOND)
    paths.review(late, 3 * SECOND + 1)
    assert run.task.clearance_margin == 0.012


def test_any_clearance_will_do_where_none_is_asked_for(run: Run) -> None:
    assert run.paths.review(run.offer(certain_clearance=-0.05), SECOND) is None


def test_material_that_the_planner_does_not_know_outdates_no_path(run: Run) -> None:
    run.task.set("adapt", "true")
    run.material.bending_stiffness, run.material.informs_planner = 2.0, False
    assert run.paths.review(run.offer(), 2 * SECOND) is None


def test_path_that_begins_elsewhere_is_not_followed(run: Run) -> None:
    assert run.paths.review_start(run.offer(), path(), HERE, SECOND) is None
    reason = run.paths.review_start(run.offer(), path(start=0.01), HERE, SECOND)
    assert code_of(reason) is ReasonCode.PATH_STARTS_ELSEWHERE


def test_path_among_moving_obstacles_begins_in_time_or_is_asked_for_again(run: Run) -> None:
    offer, asked = run.offer(start_after=3 * SECOND, start_before=4 * SECOND), run.task.replan_count

    def reason(now: int) -> ReasonCode | None:
        return code_of(run.paths.review_start(offer, path(), HERE, now))

    assert reason(2 * SECOND) is ReasonCode.WAITING_FOR_OBSTACLE
    assert reason(3 * SECOND) is reason(4 * SECOND) is None
    assert run.task.replan_count == asked
    assert reason(4 * SECOND + 1) is ReasonCode.DEPARTURE_MISSED
    assert run.task.replan_count == asked + 1


def test_rope_that_turns_out_to_be_another_one_on_the_way_needs_another_path(
    run: Run,
) -> None:
    run.paths.follow(run.offer())
    assert not run.paths.outdated()
    run.task.set("adapt", "true")
    run.material.bending_stiffness = 1.2
    assert not run.paths.outdated()
    run.material.bending_stiffness, run.material.deviation = 1.3, 0.2
    assert not run.paths.outdated()
    run.material.deviation = 0.1
    asked = run.task.replan_count
    assert [run.paths.outdated() for _ in range(3)] == [True, True, False]
    assert run.task.replan_count == asked + 2
