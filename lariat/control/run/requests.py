"""Requests of a person: goals, starts and stops, and previews of a goal that is being dragged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum, auto

from lariat.control.run.arm_condition import ArmCondition
from lariat.control.run.goals import GoalFactory, Pull
from lariat.control.run.reasons import Reason
from lariat.control.run.state_machine import RunState
from lariat.control.run.task import RequestRefused, Task
from lariat.geometry.obstacles import Obstacle
from lariat.scenario import Goal, Scenario, Shape

ENDED = (RunState.REACHED, RunState.FAILED)
"""States after a run that nobody has stopped or paused."""
STANDING = (RunState.IDLE, *ENDED)
"""States without a run."""


class RequestAction(Enum):
    """Action that a person requests, named as in the message `TaskRequest`."""

    SET_GOAL = auto()
    START = auto()
    PAUSE = auto()
    STOP = auto()
    RESET = auto()
    SET = auto()
    RESTORE = auto()


@dataclass(frozen=True)
class Request:
    """Request of a person."""

    id: str
    """Id that the answer repeats."""
    action: RequestAction | None
    """Requested action; None for one that is not known, which changes nothing."""
    goal: Goal | None = None
    """Goal of `SET_GOAL`."""
    key: str = ""
    """Name of the setting of `SET`."""
    value: str = ""
    """Value of the setting of `SET`."""
    move: bool = False
    """Whether the person who set a goal has agreed that the arms go there at once."""


@dataclass(frozen=True)
class Preview:
    """Goal between grips that are being dragged."""

    goal: Goal | None
    """Rod at rest between the grips; None where there is none."""
    problem: str = ""
    """Reason why it cannot be the goal; empty where it can."""


def carry_out(
    request: Request,
    task: Task,
    goals: GoalFactory,
    obstacles: tuple[Obstacle, ...],
    arms: ArmCondition | None,
    now: int,
    obstruction: Reason | None = None,
) -> bool:
    """Carry out a request, or record why it is refused.

    Args:
        request: Request of a person.
        task: Task that it changes.
        goals: Factory of goals.
        obstacles: Obstacles of the scene.
        arms: Condition of the arms; None while their poses are not known.
        now: Present time [ns].
        obstruction: Reason why no run can begin, where the controller knows one.

    Returns:
        Whether a run has begun with it.
    """
    begun, refusal = False, ""
    try:
        match request.action:
            case RequestAction.SET_GOAL:
                if request.goal is None:
                    raise RequestRefused("the request holds no goal; give nodes or both grips")
                goal = goals.from_request(request.goal, obstacles)
                goals.check(goal, obstacles)
                # A person who set a goal after a run expects the rope to follow; a real arm moves
                # only where somebody has just agreed to it.
                agreed = request.move and task.state in STANDING
                follows = agreed or (task.resettable and task.state in ENDED)
                task.set_goal(goal)
                if follows and _refusal(arms, obstruction) is None:
                    task.start(now)
                    begun = True
            case RequestAction.START:
                resumed = task.state is RunState.PAUSED
                if reason := _refusal(arms, obstruction):
                    raise RequestRefused(reason)
                task.start(now)
                begun = not resumed
            case RequestAction.PAUSE:
                task.pause()
            case RequestAction.STOP:
                task.stop()
            case RequestAction.RESET:
                task.reset()
            case RequestAction.RESTORE:
                goal = goals.from_shape(goals.scenario.goal)
                task.restore(goal)
            case RequestAction.SET:
                task.set(request.key, request.value)
    except RequestRefused as error:
        refusal = str(error)
    task.answer(request.id, refusal)
    return begun


def preview(
    request: Goal,
    pull: Pull | None,
    goals: GoalFactory,
    obstacles: tuple[Obstacle, ...],
    running: bool,
) -> Preview:
    """Rod at rest between grips that are being dragged, or the reason why there is none.

    Args:
        request: Grips of a person.
        pull: Node that is pulled, and where to [m]; None where the grips stay.
        goals: Factory of goals.
        obstacles: Obstacles of the scene.
        running: Whether a run goes on, whose steps must not wait for a pulled node.
    """
    if pull is not None and running:
        return Preview(None, "a run goes on; pause or stop it to pull the rope at a node")
    goal = None
    try:
        goal = goals.from_request(request, obstacles, pull)
        goals.check(goal, obstacles)
    except ValueError as error:
        return Preview(goal, str(error))
    return Preview(goal)


def route_preview(
    scenario: Scenario,
    shape: Shape,
    obstacles: Sequence[Obstacle],
    report: Callable[[str], None],
) -> Preview:
    """Rod that is laid along a route, or the reason why it cannot be; this takes seconds.

    Args:
        scenario: Cell.
        shape: Ends and route.
        obstacles: Obstacles of the scene, with the legs of clips.
        report: Takes in words what is done at present.
    """
    goal = None
    try:
        goals = GoalFactory.of_scenario(scenario)
        goal = goals.laid(shape, obstacles, report)
        goals.check(goal, tuple(obstacles))
    except ValueError as error:
        return Preview(goal, str(error))
    return Preview(goal)


def _refusal(arms: ArmCondition | None, obstruction: Reason | None) -> str | None:
    """Return why a run cannot begin; None if it can."""
    if obstruction is not None:
        return str(obstruction)
    if arms is None:
        return "the arms have not reported their poses yet; is the gateway running?"
    if not arms.armed:
        return f"the arms are disarmed ({arms.reason}); arm them first"
    if not arms.available:
        return f"the arms hold ({arms.reason}); acknowledge and resume first"
    return None
