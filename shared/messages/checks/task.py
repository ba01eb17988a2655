"""Checks of goals, and of the messages that lead to them."""

from __future__ import annotations

import numpy as np

from lariat.safety.motion_contract import SETPOINT_PERIOD
from lariat.scenario.sections import MIN_PART_NODES
from shared import messages
from shared.messages.checks.values import (
    MAX_COORDINATE,
    MAX_NODES,
    Checks,
    check_bounded,
    check_integer,
    check_length,
    check_places,
    check_rotation,
    check_rotations,
    check_turns,
    count_nodes,
    count_points,
)

MAX_ROUTE = 100
"""Largest number of clips and pegs of a route [-]."""
MIN_PACE = 1e-3
"""Least pace of a path, as a fraction of the planner's [-]."""


def _check_grip(name: str, grip: messages.Grip, *empty: int) -> None:
    """Check a grip, whose fields may have no values where `empty` is 0."""
    check_length(f"{name}.position", grip.position, *empty, 3)
    check_length(f"{name}.orientation", grip.orientation, *empty, 4)
    check_places(f"{name}.position", grip.position)
    check_rotation(f"{name}.orientation", grip.orientation)


def check_goal(goal: messages.Goal) -> None:
    """Check the lengths and the places of a goal."""
    count_nodes("goal.positions", goal.positions)
    check_places("goal.positions", goal.positions)
    check_turns(goal.turns)
    if goal.part and goal.ends_only:
        raise ValueError("goal.part and goal.ends_only exclude each other")
    if goal.route and (goal.part or goal.ends_only or len(goal.route) > MAX_ROUTE):
        raise ValueError(
            f"goal.route has {len(goal.route)} entries; it has up to {MAX_ROUTE}, without part and "
            "ends_only"
        )
    if goal.part:
        check_length("goal.part", goal.part, 2)
        node_count = np.sum(messages.goal_of(goal).counted)
        if node_count < MIN_PART_NODES:
            raise ValueError(
                f"goal.part = {list(goal.part)} m holds {node_count} of the goal's nodes, "
                f"less than {MIN_PART_NODES}"
            )
    _check_grip("goal.left", goal.left, 0)
    _check_grip("goal.right", goal.right, 0)


def _check_task_state(message: messages.TaskState) -> None:
    check_goal(message.goal)
    if message.goal.positions:
        _check_whole_grips(message.goal)
    check_turns(message.turns)
    if message.pace and not MIN_PACE <= message.pace <= 1.0:
        raise ValueError(f"pace = {message.pace:g} is not within {MIN_PACE:g}…1")
    if not 0.0 <= message.clearance_margin <= MAX_COORDINATE:
        raise ValueError(f"clearance_margin = {message.clearance_margin:g} m")


def _check_with_goal(
    message: messages.TaskRequest | messages.GoalPreview | messages.GoalListRequest,
) -> None:
    check_goal(message.goal)


def _check_goal_list(message: messages.GoalList) -> None:
    for saved in message.goals:
        check_goal(saved.goal)


def _check_draft(draft: messages.GoalDraft) -> None:
    _check_whole_grips(draft)
    check_turns(draft.turns)
    if draft.pull:
        check_length("pull", draft.pull, 3)
        check_places("pull", draft.pull)


def _check_whole_grips(message: messages.Goal | messages.GoalDraft) -> None:
    _check_grip("left", message.left)
    _check_grip("right", message.right)


def _check_path(message: messages.Path) -> None:
    count = count_points("left_positions", message.left_positions)
    check_length("right_positions", message.right_positions, 3 * count)
    check_length("left_orientations", message.left_orientations, 4 * count)
    check_length("right_orientations", message.right_orientations, 4 * count)
    check_places("left_positions", message.left_positions)
    check_places("right_positions", message.right_positions)
    check_rotations("left_orientations", message.left_orientations)
    check_rotations("right_orientations", message.right_orientations)
    check_length("nodes", message.nodes, 3 * message.node_count * count)
    if count and message.dt != SETPOINT_PERIOD:
        raise ValueError(f"dt = {message.dt} ns; a path takes {SETPOINT_PERIOD} ns")


def _check_plan(message: messages.Plan) -> None:
    for name in ("stamp", "dt"):
        check_integer(name, getattr(message, name))
    check_bounded("nodes", message.nodes)
    if message.node_count > MAX_NODES or len(message.nodes) % max(3 * message.node_count, 1):
        raise ValueError(f"{len(message.nodes)} values are no chains of {message.node_count} nodes")


CHECKS: Checks = {
    messages.TaskState: _check_task_state,
    messages.TaskRequest: _check_with_goal,
    messages.GoalPreview: _check_with_goal,
    messages.GoalListRequest: _check_with_goal,
    messages.GoalList: _check_goal_list,
    messages.GoalDraft: _check_draft,
    messages.Path: _check_path,
    messages.Plan: _check_plan,
}
"""Check of each type of message."""
