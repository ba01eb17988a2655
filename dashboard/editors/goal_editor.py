"""Goal editor: draggable grips and nodes, the stretch that counts, a preview of the rod at rest."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import viser

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.controls import status_text
from dashboard.controls.status_text import StatusLine
from dashboard.editors.counted_stretch import CountedStretch
from dashboard.editors.grip_angles import grip_angles, grip_orientation
from dashboard.editors.pull_handle import ARRIVED, PullHandle
from dashboard.editors.route_editor import RouteEditor
from dashboard.editors.route_preview import RoutePreview
from dashboard.outbox import Outbox
from dashboard.scene.scene_view import SceneView
from dashboard.uploads import Uploads
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.scenario import SIDES, Goal, Scenario, Shape, Side
from lariat.scenario.goal_table import read_goal
from lariat.trajectory import SECOND
from shared.messages import (
    GoalPreview,
    TaskRequest,
    TaskState,
    chain,
    goal_of,
)

DRAFT_PERIOD = SECOND // 20
"""Least time between two drafts of a goal that is being dragged [ns]."""
FIELD_STEP = 0.5
"""Step of the fields [mm and degrees]; it also decides how many decimals they show."""
UNITS = {"metres": 1.0, "millimetres": 1e-3}
"""Units of a shape's table, and their sizes [m]."""
GIZMO_SCALE = 0.25
"""Size of a gizmo, relative to the rope's length [-]."""


class GoalEditor:
    """Editor of the two grips of a goal, and of the turns of twist between them.

    Every change sends a draft to the controller, which answers with a preview: the rod at rest
    between the grips. A node that is pulled moves the grips. "Set goal" requests the previewed
    shape, or what of it counts; without a change there is nothing to set. A draft with a route is
    laid in a process of the page; the headings of its ends follow the route.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        scenario: Scenario,
        actions: ActionQueue,
        outbox: Outbox,
        view: SceneView,
        uploads: Uploads,
        simulated: bool,
    ) -> None:
        self._scenario = scenario
        self._outbox = outbox
        self._view = view
        self.editing = False
        """Whether a person edits a goal."""
        self._goal_revision = -1
        self._obstacles: Sequence[Obstacle] = scenario.bodies
        self._touched = False
        """Whether a person has changed the goal since the editor was opened."""
        self._changed = False
        """Whether there is a change that has not been drafted."""
        self._draft_time = 0
        self._draft_id = ""
        self._pull_number = 0
        """Number of the first draft of the present pull [-]."""
        self._preview: GoalPreview | None = None
        left, right = scenario.grips(scenario.goal)
        self._grips: dict[Side, Pose] = {"left": left, "right": right}
        self._turns = scenario.goal.turns
        driven = [s for s in SIDES if scenario.end(s).driver != "fixed"]
        self._gizmos = {side: self._add_gizmo(server.scene, side, actions) for side in driven}
        gui = server.gui
        self._set = gui.add_button(
            "Set goal" if simulated else "Set goal and move",
            icon=viser.Icon.TARGET,
            color=palette.GOOD,
            visible=False,
            disabled=True,
        )
        self._set.on_click(lambda _: actions.put(self._request_goal))
        self._edit = gui.add_button(
            "Edit goal", icon=viser.Icon.HAND_MOVE, hint="Drag both ends in the 3-D view"
        )
        self._edit.on_click(lambda _: actions.put(self._toggle))
        self._status = gui.add_html("", visible=False)
        self._fields = {side: self._add_field(gui, side, actions) for side in driven}
        rotating = [s for s in driven if scenario.end(s).rotates]
        self._angle_fields = {side: self._add_angle_field(gui, side, actions) for side in rotating}
        self._turns_fields = [self._add_turns_field(gui, actions)] if rotating else []
        self._handle = PullHandle(server, scenario, actions, self._take_pull)
        self._stretch = CountedStretch(gui, scenario.rope, actions, self._take_stretch)
        self._laying = RoutePreview(scenario)
        self.route = RouteEditor(gui, actions, self._take_route)
        """Route of the goal."""
        self._upload = gui.add_upload_button(
            "Load shape (CSV)",
            icon=viser.Icon.UPLOAD,
            color=palette.NEUTRAL,
            hint="x, y, z in each row, from the left end to the right, as a spreadsheet writes it",
        )
        unit = gui.add_dropdown("Shape in", tuple(UNITS), hint="Unit of the numbers of its table")
        self._upload.on_upload(
            lambda event: uploads.take(
                event.target.value,
                "a goal",
                partial(read_goal, scale=UNITS[unit.value]),
                partial(self._request_file, event.target.value.name),
            )
        )

    def _add_gizmo(
        self, scene: viser.SceneApi, side: Side, actions: ActionQueue
    ) -> viser.TransformControlsHandle:
        # No limits of translation: viser counts them from where the gizmo was last shown. A goal
        # outside the workspace is not reachable, and its preview says so.
        gizmo = scene.add_transform_controls(
            f"/edit/{side}",
            scale=GIZMO_SCALE * self._scenario.rope.length,
            line_width=3.0,
            disable_rotations=not self._scenario.end(side).rotates,
            depth_test=False,
            visible=False,
        )

        # A coroutine, because threads of a pool could reorder the events of a drag.
        @gizmo.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            if event.client is not None:
                position, orientation = np.array(event.target.position), event.target.wxyz
                actions.put(lambda: self._take_drag(side, position, np.array(orientation)))

        return gizmo

    def _add_field(
        self, gui: viser.GuiApi, side: Side, actions: ActionQueue
    ) -> viser.GuiVector3Handle:
        field = gui.add_vector3(
            f"{side.capitalize()} [mm]", (0.0, 0.0, 0.0), step=FIELD_STEP, visible=False
        )
        actions.on_change(field, lambda v: self._take_field(side, np.array(v, float) / 1e3))
        return field

    def _add_angle_field(
        self, gui: viser.GuiApi, side: Side, actions: ActionQueue
    ) -> viser.GuiVector3Handle:
        field = gui.add_vector3(
            f"{side.capitalize()} [°]",
            (0.0, 0.0, 0.0),
            step=FIELD_STEP,
            visible=False,
            hint="Yaw, pitch and roll of the rope at this grip",
        )
        actions.on_change(field, lambda v: self._take_angles(side, np.radians(np.array(v, float))))
        return field

    def _add_turns_field(
        self, gui: viser.GuiApi, actions: ActionQueue
    ) -> viser.GuiNumberHandle[float]:
        field = gui.add_number(
            "Turns",
            0.0,
            step=1.0,
            visible=False,
            hint="Whole turns of twist of the right end against the left one",
        )
        actions.on_change(field, self._take_turns)
        return field

    def _take_drag(self, side: Side, position: np.ndarray, orientation: np.ndarray) -> None:
        if not self._scenario.end(side).rotates:
            orientation = self._grips[side].orientation
        self._change_grip(side, Pose(position, orientation))

    def _take_field(self, side: Side, position: np.ndarray) -> None:
        if np.all(np.isfinite(position)):
            self._change_grip(side, Pose(position, self._grips[side].orientation))
            self._show_grip(side, with_gizmo=True)

    def _take_angles(self, side: Side, angles: np.ndarray) -> None:
        if np.all(np.isfinite(angles)):
            self._change_grip(side, Pose(self._grips[side].position, grip_orientation(angles)))
            self._show_grip(side, with_gizmo=True)

    def _take_turns(self, turns: float) -> None:
        if self.editing and np.isfinite(turns):
            self._handle.release()
            self._turns = float(turns)
            self._touch()

    def _take_stretch(self) -> None:
        if not self.editing:
            return
        self._touched = True
        preview = self._preview
        # A shape that is free is not pulled.
        if self._handle.visible != self._stretch.has_shape:
            self._handle.show(self._stretch.has_shape)
            if preview is not None:
                self._handle.take_shape(chain(preview.goal.positions))
        if preview is not None:
            self._show_preview(preview)

    def _take_route(self) -> None:
        if self.editing:
            self._touch()
            self._show_fields()

    def take_scene(self, obstacles: Sequence[Obstacle]) -> None:
        """Take the obstacles of the scene; a cable is laid anew where they have changed."""
        self._obstacles = obstacles
        self.route.take_scene(obstacles)
        if self.editing and self.route.route:
            self._touch()

    def _touch(self) -> None:
        self._touched = self._changed = True
        self._set.disabled = True

    def _change_grip(self, side: Side, pose: Pose) -> None:
        if not self.editing:
            return
        self._grips[side] = pose
        self._handle.release()
        self._touch()
        # A gizmo that is being dragged must not be moved from here.
        self._show_grip(side, with_gizmo=False)

    def _take_pull(self) -> None:
        if not self.editing:
            return
        if not self._pull_number:
            self._pull_number = _number(self._draft_id) + 1
        self._touch()

    def _show_grip(self, side: Side, with_gizmo: bool) -> None:
        """Set the field, and optionally the gizmo, to the pose of a grip."""
        pose = self._grips[side]
        if side in self._fields:
            self._fields[side].value = tuple((1e3 * pose.position).round(1).tolist())
        if side in self._angle_fields:
            # Plus zero: -0 would be shown as such.
            angles = np.degrees(grip_angles(pose.orientation)).round(1) + 0.0
            self._angle_fields[side].value = tuple(angles.tolist())
        if with_gizmo and side in self._gizmos:
            self._gizmos[side].position = pose.position
            # The arrows of an end that does not rotate stay along the world's axes.
            if self._scenario.end(side).rotates:
                self._gizmos[side].wxyz = pose.orientation

    def _toggle(self) -> None:
        self._set_editing(not self.editing)

    def _set_editing(self, editing: bool) -> None:
        self.editing = editing
        self._preview = None
        self._view.show_preview(None)
        self._edit.label = "Cancel" if editing else "Edit goal"
        self._edit.color = palette.NEUTRAL if editing else palette.BRAND
        self._upload.visible = not editing
        self._set.disabled = True
        for handle in (*self._gizmos.values(), *self._fields.values(), self._set, self._status):
            handle.visible = editing
        self.route.show(editing)
        self._show_fields()
        if editing:
            self._show_status(StatusLine(self._stretch.invitation, palette.QUIET))
            # Clips may have been moved since the cable was laid.
            self._touched, self._changed = bool(self.route.route), True
            for side in SIDES:
                self._show_grip(side, with_gizmo=True)
            for field in self._turns_fields:
                field.value = self._turns
        else:
            self._goal_revision = -1

    def _show_fields(self) -> None:
        """Show what else there is to edit: nothing of a cable that is laid along a route."""
        whole = self.editing and not self.route.route
        for field in (*self._angle_fields.values(), *self._turns_fields):
            field.visible = whole
        for side, gizmo in self._gizmos.items():
            gizmo.disable_rotations = not (whole and self._scenario.end(side).rotates)
        self._handle.show(whole and self._stretch.has_shape)
        self._stretch.show(whole)

    def _request_goal(self) -> None:
        # A browser that does not know yet that the goal has changed still offers the last one.
        if self._preview is None or self._set.disabled:
            return
        goal = goal_of(self._preview.goal)
        if not goal.route:
            goal = self._stretch.applied(goal)
        self._outbox.request_task(TaskRequest.SET_GOAL, "Set goal", goal=goal, move=True)
        self._set_editing(False)

    def _request_file(self, name: str, goal: Goal) -> None:
        self._outbox.request_task(TaskRequest.SET_GOAL, f"Goal {name}", goal=goal)

    def _show_status(self, line: StatusLine) -> None:
        self._status.content = status_text.as_html(line, size="0.95em", margin="0.3em 1em")

    def update(self, task: TaskState | None, preview: GoalPreview | None, now: int) -> None:
        """Show the task's goal, send a draft of what was changed, show its preview."""
        if task is not None and task.goal_revision != self._goal_revision:
            self._take_goal(goal_of(task.goal), task.goal_revision)
        if not self.editing:
            return
        if self._changed and now - self._draft_time >= DRAFT_PERIOD:
            self._changed, self._draft_time = False, now
            grips = self._grips["left"], self._grips["right"]
            pull = self._handle.pull
            self._pull_number *= pull is not None
            if self.route.route:
                self._draft_id = self._outbox.new_id()
                line = tuple(tuple(grip.position.tolist()) for grip in grips)
                shape = Shape(line=line, route=self.route.route)  # pyright: ignore[reportArgumentType]
                self._laying.request(self._draft_id, shape, self._obstacles)
            else:
                self._draft_id = self._outbox.draft_goal(*grips, self._turns, pull)
        if self.route.route:
            preview = self._take_laying()
        if preview is not None and preview is not self._preview:
            self._take_preview(preview)

    def _take_laying(self) -> GoalPreview | None:
        """Say what is done to lay a cable; return the preview when there is one."""
        try:
            news = self._laying.news()
        except (EOFError, OSError):
            news = GoalPreview(
                draft=self._draft_id, reason="its process has ended; change the draft"
            )
        if isinstance(news, GoalPreview):
            return news
        if news is not None:
            self._show_status(StatusLine("Laying the cable …", palette.BUSY, news))
        return None

    def _take_goal(self, goal: Goal, revision: int) -> None:
        self._goal_revision = revision
        self._view.show_goal(goal)
        if not self.editing and len(goal.left.position) == len(goal.right.position) == 3:
            self._grips = {"left": goal.left, "right": goal.right}
            self._turns = goal.turns
            self._stretch.take_goal(goal)
            self.route.take_route(goal.route)

    def _take_preview(self, preview: GoalPreview) -> None:
        # Drafts of other pages have ids of other sessions.
        if not preview.draft.startswith(self._draft_id.rpartition("-")[0]):
            return
        self._preview = preview
        goal = goal_of(preview.goal)
        pulled = 0 < self._pull_number <= _number(preview.draft) and len(goal.nodes) > 0
        if pulled and self._handle.pull is not None:
            self._grips = {"left": goal.left, "right": goal.right}
            for side in SIDES:
                self._show_grip(side, with_gizmo=True)
        if self._handle.take_shape(goal.nodes):
            self._changed = True
        self._show_preview(preview)

    def _show_preview(self, preview: GoalPreview) -> None:
        """Draw a preview, say what it is worth, and offer to set it as far as it may be."""
        nodes = chain(preview.goal.positions)
        self._view.show_preview(preview, self._stretch.counted(nodes))
        current = preview.draft == self._draft_id and not self._changed
        may_be_set = self._touched and current and preview.reachable and not self._stretch.problem
        self._set.disabled = not may_be_set
        self._show_status(self._verdict(preview))

    def _verdict(self, preview: GoalPreview) -> StatusLine:
        """Line about a preview."""
        if not preview.reachable:
            text = "Cannot be laid" if self.route.route else "Not reachable"
            return StatusLine(text, palette.BAD, preview.reason)
        if self.route.route:
            return StatusLine("Can be laid", palette.GOOD, "All clips of the route hold the cable.")
        if problem := self._stretch.problem:
            return StatusLine("No goal", palette.BAD, problem)
        if not self._touched:
            return StatusLine("The present goal", palette.QUIET, self._stretch.invitation)
        if self._handle.distance > ARRIVED and not self._changed:
            text = (
                f"The node stays {status_text.format_millimeters(self._handle.distance)} from the "
                "handle: nearer, there is no shape in which the rope rests."
            )
            return StatusLine("Reachable, as near as it goes", palette.WARNING, text)
        return StatusLine("Reachable", palette.GOOD, self._stretch.description)


def _number(draft: str) -> int:
    """Number of a draft, of its id; 0 before the first."""
    number = draft.rpartition("-")[2]
    return int(number) if number.isdigit() else 0
