"""Goal for a live controller, from a shape of a scenario."""

from __future__ import annotations

from dataclasses import replace

from lariat.scenario import Goal, Scenario, Shape
from shared import topics
from shared.messages import GoalDraft, GoalPreview, TaskState, goal_of, grip
from shared.runtime.clock import SystemClock
from stack.client import Client, RequestFailed


def live_goal(scenario: Scenario, shape: Shape, client: Client) -> Goal:
    """Goal of a shape; the controller computes the nodes of one given by its grips alone."""
    left, right = scenario.grips(shape)
    nodes = scenario.nodes(shape)
    if shape.leaves_grips_open or shape.route:
        return _goal_of_part(scenario, shape)
    if nodes is None:
        goal = _rest_shape(GoalDraft(left=grip(left), right=grip(right)), client)
    else:
        goal = Goal(nodes, left, right)
    return replace(
        goal,
        left_oriented=shape.left_orientation is not None and shape.part is None,
        right_oriented=shape.right_orientation is not None and shape.part is None,
        **shape.terms,
    )


def _goal_of_part(scenario: Scenario, shape: Shape) -> Goal:
    """Goal of a part of the rope, or of a route: the controller's steps cannot wait for it."""
    # Imported late: the rod starts a compiler, which other goals do not need.
    from lariat.control.run.goals import GoalFactory
    from lariat.control.run.task import RequestRefused

    try:
        return GoalFactory.of_scenario(scenario).from_shape(shape)
    except RequestRefused as error:
        raise RequestFailed(f"refused: {error}") from error


def _rest_shape(draft: GoalDraft, client: Client) -> Goal:
    """Goal at rest between two grips, computed by the controller."""
    previews = client.bus.subscribe(topics.TASK_GOAL_PREVIEW)
    # The controller's first state shows that it is connected.
    states = client.bus.subscribe(topics.TASK_STATE)
    _: TaskState = client.wait(states, lambda _: True, "the controller publishes no state")
    draft.id = client.next_id()
    draft.stamp = SystemClock().now()
    client.bus.publisher(topics.TASK_GOAL_DRAFT).put(draft)
    preview: GoalPreview = client.wait(
        previews, lambda p: p.draft == draft.id, "the controller has not answered in time"
    )
    if not preview.reachable:
        raise RequestFailed(f"refused: {preview.reason}")
    return goal_of(preview.goal)
