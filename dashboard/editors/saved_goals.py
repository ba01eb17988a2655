"""Goals by name: saved, set again, downloaded, deleted; the recorder keeps them."""

from __future__ import annotations

from functools import partial

import viser

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.outbox import Outbox
from lariat.scenario import Scenario
from lariat.scenario.goal_table import goal_table
from shared.messages import (
    GoalList,
    GoalListRequest,
    SavedGoal,
    TaskRequest,
    TaskState,
    goal_of,
)

NO_GOAL = "(none)"
"""Option of the list that stands for no goal."""


class SavedGoals:
    """List of the goals that people have named."""

    def __init__(
        self,
        gui: viser.GuiApi,
        scenario: Scenario,
        actions: ActionQueue,
        outbox: Outbox,
    ) -> None:
        self._scenario, self._actions = scenario, actions
        self._outbox = outbox
        self._goals: dict[str, SavedGoal] = {}
        self._labels: dict[str, str] = {}
        """Names of the goals by the options of the list."""
        self._task: TaskState | None = None
        self._stamp = -1
        self._list = gui.add_dropdown("Saved goal", (NO_GOAL,))
        self._list.on_update(lambda _: actions.put(self._show_choice))
        self._set = gui.add_button("Set saved goal", icon=viser.Icon.TARGET, disabled=True)
        self._set.on_click(lambda _: actions.put(self._request_goal))
        self._download = gui.add_button(
            "Download goal (CSV)",
            icon=viser.Icon.DOWNLOAD,
            color=palette.NEUTRAL,
            disabled=True,
            hint="Nodes, and what of them counts: for a scenario, or to be loaded again",
        )
        actions.on_press(self._download, self._send)
        self._delete = gui.add_button(
            "Delete goal …", icon=viser.Icon.TRASH, color=palette.NEUTRAL, disabled=True
        )
        actions.on_press(self._delete, self._ask_delete)
        self._name = gui.add_text("Goal name", "", hint="Small letters, digits, - and _")
        self._save = gui.add_button(
            "Save goal",
            icon=viser.Icon.DEVICE_FLOPPY,
            disabled=True,
            hint="Keep the present goal under this name",
        )
        self._save.on_click(lambda _: actions.put(self._request_save))

    def update(self, goals: GoalList | None, task: TaskState | None) -> None:
        """Show the goals of the recorder's list."""
        self._task = task
        self._save.disabled = goals is None or task is None or not task.goal.positions
        if goals is None or goals.stamp == self._stamp:
            return
        self._stamp = goals.stamp
        self._goals = {saved.name: saved for saved in goals.goals}
        self._labels = {
            saved.name
            if saved.scenario == self._scenario.name
            else f"{saved.name} ({saved.scenario})": saved.name
            for saved in goals.goals
        }
        options = (NO_GOAL, *self._labels)
        if tuple(self._list.options) != options:
            self._list.options = options  # pyright: ignore[reportAttributeAccessIssue]
            self._show_choice()

    @property
    def _chosen(self) -> str:
        """Name of the chosen goal; empty for none."""
        return self._labels.get(self._list.value, "")

    def _show_choice(self) -> None:
        for button in (self._set, self._download, self._delete):
            button.disabled = not self._chosen

    def _request_goal(self) -> None:
        if not (name := self._chosen):
            return
        goal = goal_of(self._goals[name].goal)
        self._outbox.request_task(TaskRequest.SET_GOAL, f"Goal {name}", goal=goal)

    def _request_save(self) -> None:
        if self._task is not None:
            name = self._name.value.strip()
            goal = goal_of(self._task.goal)
            self._outbox.request_goals(GoalListRequest.SAVE, name, "Save goal", goal)

    def _send(self, client: viser.ClientHandle) -> None:
        if name := self._chosen:
            saved = self._goals[name]
            text = goal_table(goal_of(saved.goal), name, saved.scenario)
            client.send_file_download(f"{name}.csv", text.encode(), save_immediately=True)

    def _ask_delete(self, client: viser.ClientHandle) -> None:
        if not (name := self._chosen):
            return
        request = partial(self._outbox.request_goals, GoalListRequest.DELETE, name, "Delete goal")
        self._actions.confirm(client, f"Delete the goal {name}?", (), "Delete", request)
