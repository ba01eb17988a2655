"""What a person asks for: goals, starts and stops, or a look at a goal that is being dragged."""

from __future__ import annotations

from lariat.geometry.obstacles import Obstacle
from services.controller.messages import goal_message, goal_of
from services.controller.run.goals import GoalFactory
from services.controller.run.task import RequestRefused, Task
from shared.messages import ArmStates, GoalDraft, GoalPreview, TaskRequest, grip_pose


def carry_out(
    request: TaskRequest,
    task: Task,
    goals: GoalFactory,
    obstacles: tuple[Obstacle, ...],
    arms: ArmStates | None,
    now: int,
    waits: str = "",
) -> bool:
    """Does what is asked, or answers why not; whether a run has begun with it.

    Args:
        arms: None while it is not known where they are, or no rope reaches between them.
        waits: Why no run can begin, in words, where the controller knows.
    """
    begun, refusal = False, ""
    try:
        match request.action:
            case TaskRequest.SET_GOAL:
                goal = goal_of(request.goal, goals, obstacles)
                goals.check(goal, obstacles)
                task.set_goal(goal)
            case TaskRequest.START:
                resumed = task.state == "paused"
                _check(arms, waits)
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
    task.answered(request.id, refusal)
    return begun


def preview(
    draft: GoalDraft, goals: GoalFactory, obstacles: tuple[Obstacle, ...], now: int
) -> GoalPreview:
    """The rod at rest between grips that are being dragged, or why it cannot be there."""
    answer = GoalPreview(draft=draft.id, stamp=now)
    try:
        grips = goals.held(grip_pose(draft.left), grip_pose(draft.right))
        goal = goals.between(*grips, obstacles)
        answer.goal.CopyFrom(goal_message(goal))
        goals.check(goal, obstacles)
        answer.reachable = True
    except ValueError as error:
        answer.reason = str(error)
    return answer


def _check(arms: ArmStates | None, waits: str) -> None:
    """Refuses a run that could not begin."""
    if waits:
        raise RequestRefused(waits)
    if arms is None:
        raise RequestRefused("the arms have not said yet where they are; is the gateway running?")
    if arms.mode == ArmStates.DISARMED:
        raise RequestRefused(f"the arms are disarmed ({arms.reason}); arm them first")
    if arms.mode == ArmStates.FAULT or arms.needs_acknowledgement:
        raise RequestRefused(f"the arms hold ({arms.reason}); acknowledge first")
