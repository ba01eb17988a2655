"""`lariat goal`: another goal for a live stack."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

from cli.task import HERE, ToCell, say
from shared import topics
from shared.clock import SystemClock
from shared.configuration import ConfigurationError
from shared.messages import Goal, GoalDraft, GoalPreview, TaskRequest, TaskState, grip
from shared.scenario import Rope, Scenario, Shape, load
from stack import client
from stack.client import Conversation, Unanswered

Coordinates = tuple[float, float, float, float, float, float]


def main(
    file: Annotated[Path | None, tyro.conf.Positional] = None,
    /,
    line: Coordinates | None = None,
    json: bool = False,
    cell: ToCell = HERE,
) -> int:
    """Set the goal: a scenario's, a chain of nodes, or the rope at rest between two grips.

    Examples:
      lariat goal three-cylinders
      lariat goal shape.csv
      lariat goal --line -0.17 0.15 0.22 0.17 0.15 0.24

    Args:
        file: A scenario's file or short name (its goal is taken), or a CSV of x, y, z [m] in each
            row, left end first.
        line: x, y, z of the left and of the right grip [m]; the rope hangs at rest between them.
        json: Answer with one JSON object on standard output.
        cell: Which stack.
    """
    if (file is None) == (line is None):
        raise ConfigurationError("give either a FILE or --line X Y Z X Y Z; see lariat goal --help")
    scenario = _scenario(file, line)
    scenario.grips(scenario.goal)  # reads its file, before the bus is troubled
    with client.open(cell) as talk:
        state = talk.task(TaskRequest.SET_GOAL, goal=goal_of(scenario, scenario.goal, talk))
    say(state, json)
    return 0


def _scenario(file: Path | None, line: Coordinates | None) -> Scenario:
    """One with the wanted goal; what else it says does not matter."""
    named = file is not None and not file.suffix and not file.is_file()
    if file and (named or file.suffix == ".toml"):
        return load(file)
    if file:
        shape = Shape(nodes=file.name)
    else:
        assert line is not None
        shape = Shape(line=(line[:3], line[3:]))
    folder = file.parent if file else Path()
    return Scenario("goal", Rope(length=1.0, diameter=0.01), start=shape, goal=shape, folder=folder)


def goal_of(scenario: Scenario, shape: Shape, talk: Conversation) -> Goal:
    """A shape as the controller takes it; one between two grips is asked of the controller."""
    left, right = scenario.grips(shape)
    nodes = scenario.nodes(shape)
    if nodes is None:
        goal = _at_rest(GoalDraft(left=grip(left), right=grip(right)), talk)
    else:
        goal = Goal(positions=nodes.ravel(), left=grip(left), right=grip(right))
    goal.left_oriented = shape.left_orientation is not None
    goal.right_oriented = shape.right_orientation is not None
    goal.turns = shape.turns
    return goal


def _at_rest(draft: GoalDraft, talk: Conversation) -> Goal:
    """The rod at rest between two grips, as the controller sees it."""
    previews = talk.bus.subscribe(topics.TASK_GOAL_PREVIEW)
    # The controller's first state says that it listens.
    states = talk.bus.subscribe(topics.TASK_STATE)
    _: TaskState = talk.wait(states, lambda _: True, "the controller says nothing")
    draft.id = talk.next_id()
    draft.stamp = SystemClock().now()
    talk.bus.publisher(topics.TASK_GOAL_DRAFT).put(draft)
    preview: GoalPreview = talk.wait(
        previews, lambda p: p.draft == draft.id, "the controller has not answered"
    )
    if not preview.reachable:
        raise Unanswered(f"refused: {preview.reason}")
    return preview.goal
