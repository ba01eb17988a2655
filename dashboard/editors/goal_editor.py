"""Setting a goal: two gizmos at its ends, the rod at rest between them as it will hang."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import viser

from dashboard import palette
from dashboard.action_queue import Actions
from dashboard.controls import status_text
from dashboard.controls.status_text import Line
from dashboard.editors import goal_file
from dashboard.outbox import Complaint, Outbox
from dashboard.scene.scene_view import SceneView
from lariat.geometry.poses import Pose
from shared.messages import Goal, GoalPreview, TaskRequest, TaskState, chain, grip_pose
from shared.scenario import SIDES, Scenario, Side
from shared.service import SECOND

DRAFT_PERIOD = SECOND // 20
"""Least time between two drafts while dragging [ns]."""


class GoalEditor:
    """Drag, look at the preview, set."""

    def __init__(
        self,
        server: viser.ViserServer,
        scenario: Scenario,
        actions: Actions,
        outbox: Outbox,
        view: SceneView,
        complain: Callable[[Complaint], None],
    ) -> None:
        self._scenario = scenario
        self._outbox = outbox
        self._view = view
        self._complain = complain
        self._editing = False
        self._revision = -1
        self._dirty = False
        self._drafted = 0
        self._draft = ""
        self._preview: GoalPreview | None = None
        left, right = scenario.grips(scenario.goal)
        self._grips: dict[Side, Pose] = {"left": left, "right": right}
        driven = [s for s in SIDES if scenario.end(s).driver != "fixed"]
        self._gizmos = {side: self._gizmo(server.scene, side, actions) for side in driven}
        gui = server.gui
        self._edit = gui.add_button(
            "Edit goal", icon=viser.Icon.HAND_MOVE, hint="Drag both ends in the 3-D view"
        )
        self._edit.on_click(lambda _: actions.put(self._toggle))
        self._status = gui.add_html("", visible=False)
        self._fields = {side: self._field(gui, side, actions) for side in driven}
        self._set = gui.add_button(
            "Set goal",
            icon=viser.Icon.TARGET,
            color=palette.GOOD,
            visible=False,
            disabled=True,
        )
        self._set.on_click(lambda _: actions.put(self._send))
        self._load = gui.add_upload_button(
            "Load shape (CSV)",
            icon=viser.Icon.UPLOAD,
            color=palette.NEUTRAL,
            hint="x, y, z [m] in each row, from the left end to the right",
        )
        self._load.on_upload(lambda event: actions.put(partial(self._loaded, event.target.value)))

    def _gizmo(
        self, scene: viser.SceneApi, side: Side, actions: Actions
    ) -> viser.TransformControlsHandle:
        low, high = self._scenario.limits.workspace
        gizmo = scene.add_transform_controls(
            f"/edit/{side}",
            scale=0.25 * self._scenario.rope.length,
            line_width=3.0,
            disable_rotations=not self._scenario.end(side).rotates,
            translation_limits=tuple(zip(low, high, strict=True)),
            depth_test=False,
            visible=False,
        )

        # A coroutine, because threads of a pool might overtake each other within one drag.
        @gizmo.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            if event.client is not None:
                position, orientation = np.array(event.target.position), event.target.wxyz
                actions.put(lambda: self._dragged(side, position, np.array(orientation)))

        return gizmo

    def _field(self, gui: viser.GuiApi, side: Side, actions: Actions) -> viser.GuiVector3Handle:
        field = gui.add_vector3(
            f"{side.capitalize()} [mm]", (0.0, 0.0, 0.0), step=1.0, visible=False
        )

        @field.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:
                value = np.array(event.target.value, float) / 1e3
                actions.put(lambda: self._typed(side, value))

        return field

    def _dragged(self, side: Side, position: np.ndarray, orientation: np.ndarray) -> None:
        if not self._scenario.end(side).rotates:
            orientation = self._grips[side].orientation
        self._moved(side, Pose(position, orientation))

    def _typed(self, side: Side, position: np.ndarray) -> None:
        if np.all(np.isfinite(position)):
            self._moved(side, Pose(position, self._grips[side].orientation))
            self._place(side, gizmo=True)

    def _moved(self, side: Side, pose: Pose) -> None:
        if not self._editing:
            return
        self._grips[side] = pose
        self._dirty = True
        self._set.disabled = True
        self._place(side, gizmo=False)

    def _place(self, side: Side, gizmo: bool) -> None:
        """Brings field and gizmo to the grip; a gizmo in a person's hand is left alone."""
        pose = self._grips[side]
        if side in self._fields:
            self._fields[side].value = tuple((1e3 * pose.position).round(1).tolist())
        if gizmo and side in self._gizmos:
            self._gizmos[side].position = pose.position
            # The arrows of an end that only translates point along the world's axes.
            if self._scenario.end(side).rotates:
                self._gizmos[side].wxyz = pose.orientation

    def _toggle(self) -> None:
        self._edit_mode(not self._editing)

    def _edit_mode(self, on: bool) -> None:
        self._editing = on
        self._preview = None
        self._view.preview(None)
        self._edit.label = "Cancel" if on else "Edit goal"
        self._set.disabled = True
        for handle in (*self._gizmos.values(), *self._fields.values(), self._set, self._status):
            handle.visible = on
        if on:
            self._say(Line("Drag an end", palette.QUIET))
            self._dirty = True
            for side in SIDES:
                self._place(side, gizmo=True)
        else:
            self._revision = -1

    def _send(self) -> None:
        if self._preview is None or not self._preview.reachable:
            return
        self._outbox.task(TaskRequest.SET_GOAL, "Set goal", goal=self._preview.goal)
        self._edit_mode(False)

    def _loaded(self, file: viser.UploadedFile) -> None:
        try:
            goal = goal_file.parse(file.content, self._scenario)
        except ValueError as error:
            self._complain(Complaint(f"{file.name}: not a goal", str(error)))
            return
        self._outbox.task(TaskRequest.SET_GOAL, f"Goal {file.name}", goal=goal)

    def _say(self, line: Line) -> None:
        self._status.content = status_text.as_html(line, size="0.95em", margin="0.3em 1em")

    def update(self, task: TaskState | None, preview: GoalPreview | None, now: int) -> None:
        """One step: follows the task's goal, or drafts what is being dragged.

        Args:
            preview: What the controller answered last.
            now: [ns]
        """
        if task is not None and task.goal_revision != self._revision:
            self._follow(task.goal, task.goal_revision)
        if not self._editing:
            return
        if self._dirty and now - self._drafted >= DRAFT_PERIOD:
            self._dirty, self._drafted = False, now
            self._draft = self._outbox.draft(self._grips["left"], self._grips["right"])
        if preview is not None and preview is not self._preview:
            self._show(preview)

    def _follow(self, goal: Goal, revision: int) -> None:
        self._revision = revision
        self._view.goal(chain(goal.positions))
        if not self._editing and len(goal.left.position) == len(goal.right.position) == 3:
            self._grips = {"left": grip_pose(goal.left), "right": grip_pose(goal.right)}

    def _show(self, preview: GoalPreview) -> None:
        if not preview.draft.startswith(self._draft.rpartition("-")[0]):
            return
        self._preview = preview
        self._view.preview(preview)
        current = preview.draft == self._draft and not self._dirty
        self._set.disabled = not (current and preview.reachable)
        if preview.reachable:
            self._say(Line("Reachable", palette.GOOD, "The rope will rest like this."))
        else:
            self._say(Line("Not reachable", palette.BAD, preview.reason))
