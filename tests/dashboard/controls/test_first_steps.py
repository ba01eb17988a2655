"""First steps: each is done when the cell says so, and the first one says what is missing."""

from __future__ import annotations

from dashboard.controls.first_steps import FirstSteps
from shared.messages import IDLE, RUNNING, ArmStates, Goal, TaskState

GOAL = Goal(positions=[0.0] * 6)


def done(steps: FirstSteps, task: TaskState, arms: ArmStates) -> list[bool]:
    return [step.done for step in steps.update(task, arms, [])]


def test_nothing_started_says_what_is_missing() -> None:
    first, *others = FirstSteps(simulated=True).update(None, None, ["controller", "robot_gateway"])
    assert all(w in first.hint for w in ("controller, robot gateway", "lariat up"))
    assert not any(step.done for step in (first, *others))


def test_steps_follow_what_a_person_does_and_stay_done() -> None:
    steps = FirstSteps(simulated=True)
    idle = TaskState(state=IDLE, goal=GOAL, goal_revision=3)
    armed = ArmStates(mode=ArmStates.ARMED)
    held = ArmStates(mode=ArmStates.HOLDING, needs_acknowledgement=True)
    assert done(steps, idle, ArmStates(mode=ArmStates.DISARMED)) == [True] + 5 * [False]
    assert done(steps, idle, armed) == 2 * [True] + 4 * [False]
    running = TaskState(state=RUNNING, goal=GOAL, goal_revision=3, run_started=1)
    assert done(steps, running, armed) == 3 * [True] + 3 * [False]
    moved = TaskState(state=RUNNING, goal=GOAL, goal_revision=4, run_started=1)
    assert done(steps, moved, armed) == 4 * [True] + 2 * [False]
    assert done(steps, moved, held) == 5 * [True] + [False]
    acknowledged = ArmStates(mode=ArmStates.HOLDING, needs_resume=True)
    assert done(steps, moved, acknowledged) == 5 * [True] + [False]
    assert done(steps, moved, armed) == 6 * [True]
    assert done(steps, idle, ArmStates(mode=ArmStates.DISARMED)) == 6 * [True]


def test_arms_that_hold_before_any_run_were_not_held_by_a_person() -> None:
    steps = FirstSteps(simulated=True)
    idle = TaskState(state=IDLE, goal=GOAL, goal_revision=3)
    boot = ArmStates(mode=ArmStates.HOLDING, needs_acknowledgement=True)
    assert not done(steps, idle, boot)[4]
