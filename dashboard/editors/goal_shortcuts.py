"""Buttons that set a goal without the editor: the rope's present shape, and the goal before."""

from __future__ import annotations

import numpy as np
import viser

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.outbox import Outbox
from lariat.scenario import Goal
from shared.messages import (
    ArmStates,
    NodeChain,
    TaskRequest,
    TaskState,
    arm_pose,
    chain,
    goal_of,
    poses_known,
)

MAX_REMEMBERED = 50
"""Largest number of goals that are remembered [-]."""
SAME = 1e-6
"""Largest difference of two coordinates of one goal [m]."""


class GoalShortcuts:
    """Present shape as goal, and the goals of this start of the page for Undo."""

    def __init__(self, gui: viser.GuiApi, actions: ActionQueue, outbox: Outbox) -> None:
        self._outbox = outbox
        self._rope: NodeChain | None = None
        self._arms: ArmStates | None = None
        self._goals: list[Goal] = []
        """Goals in the order of their times, the present one last."""
        self._turns = 0.0
        self._revision = -1
        self._present = gui.add_button(
            "Present shape as goal",
            icon=viser.Icon.CAMERA,
            color=palette.NEUTRAL,
            visible=False,
            hint="Set the rope's present shape as the goal, e.g. to come back to it",
        )
        self._present.on_click(lambda _: actions.put(self._request_present))
        self._undo = gui.add_button(
            "Undo goal",
            icon=viser.Icon.ARROW_BACK_UP,
            color=palette.NEUTRAL,
            visible=False,
            hint="Return to the goal before",
        )
        self._undo.on_click(lambda _: actions.put(self._request_undo))

    def update(
        self,
        task: TaskState | None,
        rope: NodeChain | None,
        arms: ArmStates | None,
        editing: bool = False,
    ) -> None:
        """Take the present goal and the present shape, and show what can be done with them."""
        self._rope, self._arms = rope, arms
        if task is not None:
            self._turns = task.turns
            if task.goal_revision != self._revision and task.goal.positions:
                self._revision = task.goal_revision
                self._remember(goal_of(task.goal))
        is_known = rope is not None and not rope.lost and arms is not None and poses_known(arms)
        for button, applies in ((self._present, is_known), (self._undo, len(self._goals) > 1)):
            button.visible = applies and not editing

    def _remember(self, goal: Goal) -> None:
        """Remember a goal, unless it is the one that Undo has returned to."""
        last = self._goals[-1] if self._goals else None
        same = last is not None and (last.nodes.shape, last.terms) == (goal.nodes.shape, goal.terms)
        if last is not None and same and np.allclose(last.nodes, goal.nodes, atol=SAME):
            return
        self._goals = [*self._goals, goal][-MAX_REMEMBERED:]

    def _request_present(self) -> None:
        rope, arms = self._rope, self._arms
        if rope is None or rope.lost or arms is None:
            return
        goal = Goal(
            chain(rope.positions),
            arm_pose(arms, "left"),
            arm_pose(arms, "right"),
            turns=float(round(self._turns)),
        )
        self._outbox.request_task(TaskRequest.SET_GOAL, "Present shape", goal=goal)

    def _request_undo(self) -> None:
        if len(self._goals) > 1:
            self._goals.pop()
            self._outbox.request_task(TaskRequest.SET_GOAL, "Undo goal", goal=self._goals[-1])
