"""The supervisor holds the arms, chooses paths, asks for new ones a few times, then gives up."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from lariat.geometry.poses import Pose
from lariat.trajectory import MotionState
from services.controller.estimation.adaptation import ParameterEstimate
from services.controller.mpc.reference_trajectory import ReferenceTrajectory
from services.controller.run.arm_condition import ArmCondition
from services.controller.run.clearance_guard import Threat
from services.controller.run.progress import ProgressMonitor
from services.controller.run.reasons import ReasonCode
from services.controller.run.snag_detector import Snag
from services.controller.run.state_machine import RunState
from services.controller.run.supervisor import PathOffer, RunSupervisor
from services.controller.run.task import Task
from shared.service import SECOND
from tests.services.controller.run.test_task import task

ARMS = ArmCondition(True, True, "", 0, 0, "")
REFUSING = replace(ARMS, refused_chunks=9, refusal="joint_limits")


@dataclass
class Material:
    """Adaptation whose state a test sets."""

    settled: bool = True
    bending_stiffness: float = 1.0
    informs_planner: bool = True
    deviation: float = 0.1

    @property
    def scalars(self) -> dict[str, ParameterEstimate]:
        return {"bending_stiffness": ParameterEstimate(self.bending_stiffness, self.deviation)}


class Progress(ProgressMonitor):
    """Progress that a test sets."""

    at_rest = at_goal = without_progress = False

    def settled(self, now: int) -> bool:
        return self.at_goal

    def resting(self, now: int) -> bool:
        return self.at_rest

    def stuck(self, now: int) -> bool:
        return self.without_progress


@dataclass
class Run:
    """Run that has been started at 1 s."""

    task: Task
    progress: Progress
    material: Material
    supervisor: RunSupervisor

    def offer(self, **changes: object) -> PathOffer:
        now = PathOffer(2 * SECOND, self.task.goal_revision, self.task.replan_count, True, "", 1.0)
        return replace(now, **changes)


@pytest.fixture
def run() -> Run:
    t, progress, material = task(), Progress(0.003, 0.004), Material()
    t.start(SECOND)
    return Run(t, progress, material, RunSupervisor(t, progress, material))  # pyright: ignore


def path(*, reached: bool = True, start: float = 0.0) -> ReferenceTrajectory:
    points = np.full((2, 2, 3), start)
    turned = np.tile([1.0, 0.0, 0.0, 0.0], (2, 2, 1))
    return ReferenceTrajectory(0.02, points, turned, np.zeros((2, 5, 3)), reached, "blocked")


def code_of(reason) -> ReasonCode | None:
    return None if reason is None else reason.code


def test_arms_hold_for_the_task_the_arms_and_a_rope_that_is_not_seen(run: Run) -> None:
    def reason(
        arms: ArmCondition = ARMS, last_seen: int | None = 2 * SECOND, doubt: float = 0.0
    ) -> ReasonCode | None:
        now = 2 * SECOND + 1
        hold = run.supervisor.hold_reason(now, arms, last_seen, following=False, doubt=doubt)
        return code_of(hold)

    assert reason() is None
    assert reason(replace(ARMS, available=False)) is ReasonCode.ARMS_UNAVAILABLE
    assert reason(replace(ARMS, reset_count=1)) is ReasonCode.WAITING_FOR_RESET
    assert reason(last_seen=None) is ReasonCode.ROPE_NOT_SEEN
    assert reason(last_seen=SECOND) is ReasonCode.ROPE_NOT_SEEN
    assert reason(last_seen=SECOND, doubt=0.02) is ReasonCode.ROPE_NOT_SEEN
    assert reason(last_seen=SECOND, doubt=0.6) is ReasonCode.ROPE_DOUBTFUL
    assert reason(doubt=0.6) is None
    run.task.pause()
    assert reason() is ReasonCode.PAUSE_REQUESTED


def test_rope_that_is_lost_under_way_needs_another_path(run: Run) -> None:
    before = run.task.replan_count
    run.supervisor.hold_reason(SECOND, ARMS, None, following=False)
    assert run.task.replan_count == before
    run.supervisor.hold_reason(SECOND, ARMS, None, following=True)
    assert run.task.replan_count == before + 1


def test_refused_paths_are_planned_again_with_more_clearance_and_less_speed(run: Run) -> None:
    asked = run.task.replan_count
    margins, paces = [], []
    for k in range(1, 4):
        run.supervisor.unfollowed_reason(REFUSING, 0.0, following=True)
        assert (run.task.state, run.task.replan_count) == (RunState.RUNNING, asked + k)
        margins.append(run.task.clearance_margin)
        paces.append(run.task.pace)
    assert margins == pytest.approx([0.003, 0.006, 0.009])
    assert paces == pytest.approx([0.6, 0.36, 0.216])
    run.supervisor.unfollowed_reason(REFUSING, 0.0, following=True)
    assert (run.task.state, run.task.replan_count) == (RunState.FAILED, asked + 3)
    assert run.task.reason.code is ReasonCode.PATH_NOT_FOLLOWED
    assert "joint_limits" in str(run.task.reason)
    run.supervisor.begin_run()
    assert (run.task.clearance_margin, run.task.pace) == (0.0, 1.0)
    run.task.start(2)
    run.supervisor.unfollowed_reason(REFUSING, 0.0, following=True)
    assert run.task.state is RunState.RUNNING


def test_clearance_grows_with_the_measured_error_of_the_predictions(run: Run) -> None:
    run.supervisor.unfollowed_reason(REFUSING, 0.0, following=True, deviation=0.007)
    assert run.task.clearance_margin == pytest.approx(2.0 * (0.007 - 0.002))
    run.supervisor.unfollowed_reason(REFUSING, 0.0, following=True, deviation=0.1)
    assert run.task.clearance_margin == 0.02


def test_expected_contacts_are_planned_again_then_end_the_run_with_what_it_needs(run: Run) -> None:
    threat = Threat("post", 0.021, -0.003, 0.004, 0.007, 0.010)
    asked = run.task.replan_count
    for k in range(1, 5):
        reason = run.supervisor.threatened(threat, -0.0048)
        assert reason.code is ReasonCode.APPROACHING_OBSTACLE
        assert (run.task.state, run.task.replan_count) == (RunState.RUNNING, asked + k)
    run.supervisor.threatened(threat, -0.0048)
    assert (run.task.state, run.task.reason.code) == (RunState.FAILED, ReasonCode.CONTACT_EXPECTED)
    text = str(run.task.reason)
    assert "stopped 21.0 mm before obstacle 'post'" in text
    assert "needs 12 mm more room" in text


def test_wrong_predictions_need_a_more_careful_path_twice(run: Run) -> None:
    assert not run.supervisor.unforeseen(0.014)
    assert [run.supervisor.unforeseen(0.016) for _ in range(3)] == [True, True, False]
    assert run.task.state is RunState.RUNNING
    assert run.task.pace == pytest.approx(0.36)
    assert run.task.clearance_margin == 0.02


def test_rope_that_turns_out_to_be_another_one_on_the_way_needs_another_path(run: Run) -> None:
    run.supervisor.follow(run.offer())
    assert not run.supervisor.outdated()
    run.task.set("adapt", "true")
    run.material.bending_stiffness = 1.2
    assert not run.supervisor.outdated()
    run.material.bending_stiffness, run.material.deviation = 1.3, 0.2
    assert not run.supervisor.outdated()
    run.material.deviation = 0.1
    asked = run.task.replan_count
    assert [run.supervisor.outdated() for _ in range(3)] == [True, True, False]
    assert run.task.replan_count == asked + 2


def test_few_refusals_and_small_tracking_errors_are_no_reason(run: Run) -> None:
    few = replace(REFUSING, refused_chunks=8)
    assert run.supervisor.unfollowed_reason(few, 0.04, following=True) is None
    assert run.supervisor.unfollowed_reason(REFUSING, 0.0, following=False) is None
    reason = run.supervisor.unfollowed_reason(ARMS, 0.041, following=True)
    assert code_of(reason) is ReasonCode.ARM_OFF_COURSE


def test_reached_run_ends_when_the_rope_leaves_the_goal_while_the_arms_hold(run: Run) -> None:
    run.progress.at_goal = True
    run.supervisor.judge(3 * SECOND, path(), at_end=True)
    assert run.task.reason.code is ReasonCode.SETTLED
    run.progress.error = 0.008
    run.supervisor.released()
    assert run.task.state is RunState.REACHED
    run.progress.error = 0.010
    run.supervisor.released()
    assert (run.task.state, run.task.reason.code) == (RunState.IDLE, ReasonCode.LEFT_GOAL)


def test_only_the_answer_to_the_latest_request_is_followed(run: Run) -> None:
    review = run.supervisor.review
    assert code_of(review(None, SECOND)) is ReasonCode.WAITING_FOR_PATH
    old = run.offer(replan_count=run.task.replan_count + 1)
    assert code_of(review(old, SECOND)) is ReasonCode.WAITING_FOR_PATH
    assert review(run.offer(), SECOND) is None
    run.supervisor.follow(run.offer())
    assert run.supervisor.follows_latest
    run.task.request_path()
    assert not run.supervisor.follows_latest


def test_missing_path_ends_the_run_but_one_older_than_it_is_asked_for_again(run: Run) -> None:
    none = run.offer(found=False, stamp=SECOND - 1, answer="no way")
    assert code_of(run.supervisor.review(none, SECOND)) is ReasonCode.WAITING_FOR_PATH
    assert run.task.state is RunState.RUNNING
    again = run.offer(found=False, stamp=SECOND - 1, answer="no way")
    assert code_of(run.supervisor.review(again, SECOND)) is ReasonCode.NO_PATH
    assert (run.task.state, str(run.task.reason)) == (RunState.FAILED, "no way")


def test_run_waits_while_the_material_is_learnt_but_not_for_ever(run: Run) -> None:
    run.task.set("adapt", "true")
    run.material.settled = False
    assert code_of(run.supervisor.review(run.offer(), 2 * SECOND)) is ReasonCode.LEARNING_MATERIAL
    assert run.supervisor.review(run.offer(), 4 * SECOND) is None


def test_path_for_another_material_is_planned_again_twice(run: Run) -> None:
    run.task.set("adapt", "true")
    run.material.bending_stiffness = 2.0
    for _ in range(2):
        reason = run.supervisor.review(run.offer(), 2 * SECOND)
        assert code_of(reason) is ReasonCode.PATH_OUTDATED
    assert run.supervisor.review(run.offer(), 2 * SECOND) is None


def test_material_that_the_planner_does_not_know_outdates_no_path(run: Run) -> None:
    run.task.set("adapt", "true")
    run.material.bending_stiffness, run.material.informs_planner = 2.0, False
    assert run.supervisor.review(run.offer(), 2 * SECOND) is None


def test_path_that_begins_elsewhere_is_not_followed(run: Run) -> None:
    here = MotionState.at_rest(*[Pose(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))] * 2)
    assert run.supervisor.review_start(path(), here) is None
    reason = run.supervisor.review_start(path(start=0.01), here)
    assert code_of(reason) is ReasonCode.PATH_STARTS_ELSEWHERE


def test_stalled_run_asks_for_two_paths_then_fails(run: Run) -> None:
    now = 2 * SECOND
    for expected in (1, 2):
        run.supervisor.judge(now, path(), at_end=True)
        now += 5 * SECOND + 1
        run.supervisor.judge(now, path(), at_end=True)
        assert run.task.replan_count == expected
    run.supervisor.judge(now, path(), at_end=True)
    run.supervisor.judge(now + 5 * SECOND + 1, path(), at_end=True)
    assert (run.task.state, run.task.reason.code) == (RunState.FAILED, ReasonCode.STALLED)


def test_rope_at_rest_at_the_end_of_a_path_that_ends_short_fails(run: Run) -> None:
    run.progress.at_rest = run.progress.without_progress = True
    short = path(reached=False)
    run.supervisor.judge(2 * SECOND, short, at_end=True)
    assert run.task.state is RunState.RUNNING
    run.supervisor.judge(4 * SECOND, short, at_end=True)
    assert run.task.reason.code is ReasonCode.PATH_ENDS_SHORT
    assert str(run.task.reason) == "blocked"


def test_nothing_is_judged_before_the_end_of_the_path(run: Run) -> None:
    run.progress.at_goal = True
    run.supervisor.judge(60 * SECOND, path(), at_end=False)
    assert run.task.state is RunState.RUNNING


def test_snag_ends_the_run_and_says_where(run: Run) -> None:
    assert run.supervisor.snagged(Snag("taut", np.array([0.02, 0.0, 0.31])), 0.0)
    assert run.task.reason.code is ReasonCode.SNAG_TAUT
    assert "near [0.02, 0.00, 0.31] m: it is taut" in str(run.task.reason)


def test_rope_that_stays_behind_once_gets_another_path_and_a_slower_pace(run: Run) -> None:
    snag, before = Snag("stays_behind", np.array([0.02, 0.0, 0.31])), run.task.replan_count
    assert not run.supervisor.snagged(snag, 0.004)
    assert (run.task.state, run.task.replan_count) == (RunState.RUNNING, before + 1)
    assert run.task.pace < 1.0
    assert run.supervisor.snagged(snag, 0.004)
    assert run.task.reason.code is ReasonCode.SNAG_STAYS_BEHIND


def test_obstacle_in_the_rest_of_the_path_needs_another_one(run: Run) -> None:
    before = run.task.replan_count
    run.supervisor.path_obstructed(0.006)
    assert run.task.replan_count == before
    run.supervisor.path_obstructed(0.004)
    assert run.task.replan_count == before + 1
