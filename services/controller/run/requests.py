"""Requests of a person: goals, starts and stops, and previews of a goal that is being dragged."""

from __future__ import annotations

from lariat.geometry.obstacles import Obstacle
from services.controller.messages import goal_message, goal_of
from services.controller.run.goals import GoalFactory
from services.controller.run.reasons import Reason
from services.controller.run.state_machine import RunState
from services.controller.run.task import RequestRefused, Task
from shared.messages import ArmStates, GoalDraft, GoalPreview, TaskRequest, grip_pose


def carry_out(
    request: TaskRequest,
    task: Task,
    goals: GoalFactory,
    obstacles: tuple[Obstacle, ...],
    arms: ArmStates | None,
    now: int,
    obstruction: Reason | None = None,
) -> bool:
    """Carry out a request, or record why it is refused.

    Args:
        request: Request of a person.
        task: Task that it changes.
        goals: Maker of goals.
        obstacles: Obstacles of the scene.
        arms: State of the arms; None while their poses are not known.
        now: Present time [ns].
        obstruction: Reason why no run can begin, where the controller knows one.

    Returns:
        Whether a run has begun with it.
    """
    begun, refusal = False, ""
    try:
        match request.action:
            case TaskRequest.SET_GOAL:
                goal = goal_of(request.goal, goals, obstacles)
                goals.check(goal, obstacles)
                task.set_goal(goal)
            case TaskRequest.START:
                resumed = task.state is RunState.PAUSED
                _check_arms(arms, obstruction)
                task.start(now)
                begun = not resumed
            case TaskRequest.PAUSE:
                task.pause()
            case TaskRequest.STOP:
                task.stop()
            case TaskRequest.RESET:
                task.reset()
            case TaskRequest.SET:
                task.set(request.key, request.value)
    except RequestRefused as error:
        refusal = str(error)
    task.answer(request.id, refusal)
    return begun


def preview(
    draft: GoalDraft, goals: GoalFactory, obstacles: tuple[Obstacle, ...], now: int
) -> GoalPreview:
    """Rod at rest between grips that are being dragged, or the reason why there is none.

    Args:
        draft: Grips of a person.
        goals: Maker of goals.
        obstacles: Obstacles of the scene.
        now: Present time [ns].
    """
    answer = GoalPreview(draft=draft.id, stamp=now)
    try:
        grips = goals.feasible_grips(grip_pose(draft.left), grip_pose(draft.right))
        goal = goals.at_rest(*grips, obstacles)
        answer.goal.CopyFrom(goal_message(goal))
        goals.check(goal, obstacles)
        answer.reachable = True
    except ValueError as error:
        answer.reason = str(error)
    return answer


def _check_arms(arms: ArmStates | None, obstruction: Reason | None) -> None:
    """Refuse a run that the arms cannot begin."""
    if obstruction is not None:
        raise RequestRefused(str(obstruction))
    if arms is None:
        raise RequestRefused("the arms have not reported their poses yet; is the gateway running?")
    if arms.mode == ArmStates.DISARMED:
        raise RequestRefused(f"the arms are disarmed ({arms.reason}); arm them first")
    if arms.mode == ArmStates.FAULT or arms.needs_acknowledgement:
        raise RequestRefused(f"the arms hold ({arms.reason}); acknowledge first")
