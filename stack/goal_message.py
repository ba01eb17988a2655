"""Goal message for a live controller, from a shape of a scenario."""

from __future__ import annotations

from shared import topics
from shared.clock import SystemClock
from shared.messages import Goal, GoalDraft, GoalPreview, TaskState, grip
from shared.scenario import Scenario, Shape
from stack.client import Client, RequestFailed


def goal_message(scenario: Scenario, shape: Shape, client: Client) -> Goal:
    """Goal message of a shape; the controller computes the nodes of one given by its grips alone.

    Args:
        scenario: The cell.
        shape: A shape given by its nodes or by its grips alone.
        client: Connection to the live stack.

    Raises:
        RequestFailed: The controller does not answer, or no rope reaches between the grips.
    """
    left, right = scenario.grips(shape)
    nodes = scenario.nodes(shape)
    if nodes is None:
        goal = _rest_shape(GoalDraft(left=grip(left), right=grip(right)), client)
    else:
        goal = Goal(positions=nodes.ravel(), left=grip(left), right=grip(right))
    goal.left_oriented = shape.left_orientation is not None
    goal.right_oriented = shape.right_orientation is not None
    goal.turns = shape.turns
    return goal


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
    return preview.goal
