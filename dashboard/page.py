"""The whole page: what is drawn where, and which message goes into which part."""

from __future__ import annotations

from collections.abc import Sequence

import viser
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

from dashboard import palette
from dashboard.action_queue import Actions
from dashboard.controls import status_text
from dashboard.controls.run_controls import ArmControls, RunControls
from dashboard.editors.goal_editor import GoalEditor
from dashboard.editors.obstacle_editor import ObstacleEditor
from dashboard.outbox import Complaint, Outbox
from dashboard.panels import health_table
from dashboard.panels.camera_image import CameraView
from dashboard.panels.run_plots import ParameterTable, RunPlots
from dashboard.scene.scene_view import HIDDEN_AT_FIRST, LAYERS, SceneView, camera_pose
from dashboard.server import notify, stop
from shared import topics
from shared.messages import (
    ArmStates,
    Parameters,
    Scene,
    TaskState,
    scene_obstacles,
    stamp_of,
)
from shared.scenario import SIDES, Scenario
from shared.service import SECOND, Inbox
from shared.topics import Topic

SERVICES = (
    "sim",
    "perception",
    "planner",
    "controller",
    "robot_gateway",
    "recorder",
    "dashboard",
)
"""Rows of the health table that are there from the start."""
IDLE_PERIOD = SECOND
"""Between two drawings while nobody looks [ns]."""
HEALTH_PERIOD = SECOND // 2
IMAGES = 8
"""Images that wait for the rope that is seen in them."""

CAMERA_COLOR = topics.CAMERA_COLOR.at(topics.CAMERA)
CAMERA_CALIBRATION = topics.CAMERA_CALIBRATION.at(topics.CAMERA)
READS: tuple[Topic, ...] = (
    CAMERA_COLOR,
    CAMERA_CALIBRATION,
    topics.ROPE_NODES,
    topics.ROPE_TRUTH,
    topics.SCENE_STATE,
    topics.TASK_STATE,
    topics.TASK_GOAL_PREVIEW,
    topics.CONTROLLER_PATH,
    topics.CONTROLLER_PLAN,
    topics.CONTROLLER_PARAMETERS,
    topics.ARM_STATE,
    topics.RUN_RESULT,
    topics.RUN_RECORD,
    topics.STACK_STATE,
    *(topics.HEALTH.at(name) for name in SERVICES),
)


class Page:
    """One server's page; every method is called in the thread that steps."""

    def __init__(
        self, server: viser.ViserServer, scenario: Scenario, outbox: Outbox, live: bool = True
    ) -> None:
        """Args:
        live: Whether there is a cell to be asked for something; a recording is only watched.
        """
        self._server = server
        self._outbox = outbox
        self._actions = Actions()
        gui = server.gui
        gui.set_panel_label(f"Lariat · {scenario.name}")
        simulated = not any(scenario.end(s).address for s in SIDES)
        self._run = RunControls(gui, self._actions, outbox, live, resettable=simulated)
        with gui.add_folder("Arms"):
            self._arms = ArmControls(gui, self._actions, outbox, live, self.complain)
        self._view = SceneView(server, scenario, lambda name: self._obstacles.clicked(name))
        with gui.add_folder("Goal", visible=live):
            self._goal = GoalEditor(
                server, scenario, self._actions, outbox, self._view, self.complain
            )
        with gui.add_folder("Obstacles", expand_by_default=False, visible=live):
            self._obstacles = ObstacleEditor(server, scenario, self._actions, outbox, self.complain)
        with gui.add_folder("View", expand_by_default=False):
            self._add_layers(gui)
        gui.main_panel.dock_left()
        gui.main_panel.set_width(300)
        panel = gui.add_panel()
        with panel.add_tab("Run", viser.Icon.CHART_LINE):
            self._camera = CameraView(server, camera_pose(scenario))
            self._plots = RunPlots(gui, scenario)
        with panel.add_tab("Rope", viser.Icon.ADJUSTMENTS):
            self._parameters = ParameterTable(gui)
        with panel.add_tab("Health", viser.Icon.HEARTBEAT):
            self._health = gui.add_html("")
            self._recorder = gui.add_html("")
        panel.dock_right()
        panel.set_width(400)
        self._drawn = 0
        self._health_drawn = 0
        self._pending: dict[str, object] = {}
        self._images: dict[int, CompressedImage] = {}
        self._eager = True
        self._refused_setpoints = 0
        self._obstacles.update(scenario.bodies)

    def _add_layers(self, gui: viser.GuiApi) -> None:
        for label, layer in LAYERS.items():
            box = gui.add_checkbox(label, layer not in HIDDEN_AT_FIRST)
            box.on_update(
                lambda event, layer=layer: self._actions.put(
                    lambda: self._view.layer(layer, event.target.value)
                )
            )
        gui.add_html(legend())

    def complain(self, complaint: Complaint) -> None:
        """Tells everyone who looks why something did not happen."""
        notify(self._server, complaint.title, complaint.reason)

    def act(self) -> None:
        """Does what people asked for since the last step."""
        for action in self._actions.take():
            action()

    def show(self, inbox: Inbox, now: int) -> None:
        """Brings the page up to date.

        Args:
            now: [ns]
        """
        task, task_age = _latest(inbox, topics.TASK_STATE, now)
        arms = [r.message for r in inbox.every(topics.ARM_STATE)]
        scene = _latest(inbox, topics.SCENE_STATE, now)[0]
        for complaint in self._outbox.complaints(now, task, scene, arms):
            self.complain(complaint)
        self._note_refused_setpoints(arms)
        if fresh := inbox.fresh(topics.TASK_STATE):
            self._plots.add(fresh.message)
        if fresh := inbox.fresh(topics.CONTROLLER_PARAMETERS):
            self._parameters.add(fresh.message)
        for topic in (topics.SCENE_STATE, topics.CONTROLLER_PATH, topics.RUN_RESULT):
            if fresh := inbox.fresh(topic):
                self._pending[topic.key] = fresh.message
        if not self._server.get_clients() and now - self._drawn < IDLE_PERIOD:
            return
        self._drawn = now
        with self._server.atomic():
            self._draw(inbox, now, task, task_age)

    def _draw(self, inbox: Inbox, now: int, task: TaskState | None, task_age: float) -> None:
        arms, arms_age = _latest(inbox, topics.ARM_STATE, now)
        rope, _ = _latest(inbox, topics.ROPE_NODES, now)
        preview, _ = _latest(inbox, topics.TASK_GOAL_PREVIEW, now)
        self._run.update(status_text.headline(task, task_age, arms, rope), task)
        self._arms.update(arms, arms_age)
        self._goal.update(task, preview, now)
        self._draw_scene(inbox, rope, arms)
        if (scene := self._pending.pop(topics.SCENE_STATE.key, None)) is not None:
            self._take_scene(scene)
        if (result := self._pending.pop(topics.RUN_RESULT.key, None)) is not None:
            self._plots.result(result)
        self._plots.draw(now / SECOND)
        self._parameters.draw(now / SECOND)
        self._draw_picture(inbox, now)
        if now - self._health_drawn >= HEALTH_PERIOD:
            self._health_drawn = now
            self._draw_health(inbox, now)

    def _draw_scene(self, inbox: Inbox, rope: object, arms: ArmStates | None) -> None:
        if inbox.fresh(topics.ROPE_NODES):
            self._view.rope(rope)
        if truth := inbox.fresh(topics.ROPE_TRUTH):
            self._view.truth(truth.message)
        if plan := inbox.fresh(topics.CONTROLLER_PLAN):
            self._view.plan(plan.message)
        if (path := self._pending.pop(topics.CONTROLLER_PATH.key, None)) is not None:
            self._view.path(path)
        if arms is not None:
            self._view.arms(arms)

    def _draw_picture(self, inbox: Inbox, now: int) -> None:
        """Shows an image when the rope that was seen in it is known."""
        if image := inbox.fresh(CAMERA_COLOR):
            self._images[stamp_of(image.message)] = image.message
            if self._eager:
                self._eager = False
                self._camera.show(image.message, None, None)
            while len(self._images) > IMAGES:
                oldest = min(self._images)
                # Nobody finds a rope in them: they are shown all the same.
                self._camera.show(self._images.pop(oldest), None, None)
        if rope := inbox.fresh(topics.ROPE_NODES):
            image = self._images.get(rope.message.stamp)
            if image is not None:
                self._camera.show(image, rope.message, _latest(inbox, CAMERA_CALIBRATION, now)[0])
                self._images = {s: i for s, i in self._images.items() if s > rope.message.stamp}

    def _take_scene(self, scene: Scene) -> None:
        try:
            bodies = scene_obstacles(scene)
        except ValueError as error:
            self.complain(Complaint("The scene cannot be drawn", str(error)))
            return
        self._view.obstacles(bodies)
        self._obstacles.update(bodies)

    def _draw_health(self, inbox: Inbox, now: int) -> None:
        states = {}
        for name in SERVICES:
            message, age = _latest(inbox, topics.HEALTH.at(name), now)
            if message is not None:
                states[name] = (message, age)
        stack, _ = _latest(inbox, topics.STACK_STATE, now)
        record, _ = _latest(inbox, topics.RUN_RECORD, now)
        content = health_table.table(SERVICES, states, stack)
        if self._health.content != content:
            self._health.content = content
        content = health_table.recorder_html(record)
        if self._recorder.content != content:
            self._recorder.content = content

    def _note_refused_setpoints(self, arms: Sequence[ArmStates]) -> None:
        for state in arms:
            refused, known = state.refused_sequence, self._refused_setpoints
            self._refused_setpoints = refused
            # A controller that insists is refused fifty times a second: say it once a second.
            if refused and (known == 0 or refused > known + 50 or refused < known):
                self.complain(
                    Complaint("Motion refused by the gateway", f"{state.rule}: {state.reason}")
                )

    def forget(self) -> None:
        """Clears what was drawn over time, for a jump in a recording."""
        self._images.clear()
        self._eager = True
        self._health_drawn = self._drawn = 0
        self._plots.clear()
        self._parameters.clear()

    def remember(self, message: TaskState | Parameters) -> None:
        """Takes what was said before the moment that a recording jumped to."""
        if isinstance(message, TaskState):
            self._plots.add(message)
        else:
            self._parameters.add(message)

    def close(self) -> None:
        """Ends the page's threads and its server."""
        self._camera.close()
        stop(self._server)


def legend() -> str:
    """What the colours mean."""
    rows = (
        (palette.ROPE, "rope, seen well"),
        (palette.VAGUE, "rope, uncertain by 10 mm or more"),
        (palette.BRIDGED, "rope, not seen but bridged"),
        (palette.PREDICTION, "prediction: the later, the brighter"),
        (palette.PATH, "planned path of the grips"),
        (palette.GOAL, "goal"),
        (palette.SUPPORT, "obstacle that may bear the rope"),
    )
    items = "".join(
        f"<div style='display:flex;gap:.6em;align-items:center'><span style='width:1.1em;height:"
        f".35em;border-radius:.2em;background:{palette.css(color)}'></span>{text}</div>"
        for color, text in rows
    )
    return f"<div style='margin:.5em 1em;font-size:.8em;line-height:1.7;opacity:.9'>{items}</div>"


def _latest(inbox: Inbox, topic: Topic, now: int) -> tuple:
    """The newest message and its age [s]."""
    item = inbox.latest(topic)
    return (None, 0.0) if item is None else (item.message, (now - item.received) / SECOND)
