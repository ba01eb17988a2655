"""Layout of the page, and delivery of messages to its parts."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import viser

from dashboard import icons
from dashboard.action_queue import ActionQueue
from dashboard.controls import status_text
from dashboard.controls.arm_controls import ArmControls
from dashboard.controls.run_controls import RunControls
from dashboard.editors.goal_editor import GoalEditor
from dashboard.editors.goal_shortcuts import GoalShortcuts
from dashboard.editors.obstacle_editor import ObstacleEditor
from dashboard.editors.saved_goals import SavedGoals
from dashboard.outbox import Notification, Outbox
from dashboard.panels.camera_feed import CameraFeed
from dashboard.panels.camera_image import CameraImage
from dashboard.panels.campaign.campaign_panel import CampaignPanel
from dashboard.panels.checks_panel import ChecksPanel
from dashboard.panels.control_panel import ControlPanel
from dashboard.panels.events.events_panel import EventsPanel
from dashboard.panels.health_panel import HealthPanel
from dashboard.panels.parameter_panel import ParameterPanel
from dashboard.panels.run_plots import RunPlots
from dashboard.panels.runs.runs_panel import RunsPanel
from dashboard.panels.scenario.scenario_panel import ScenarioPanel
from dashboard.scene.legend import COLORINGS, Coloring, legend_html
from dashboard.scene.scene_setup import set_theme, show_whole
from dashboard.scene.scene_view import INITIALLY_HIDDEN, LAYERS, SceneView
from dashboard.subscriptions import HEALTHS, STALE_AGE, latest_with_age, unheard
from dashboard.uploads import Uploads
from dashboard.web.site import notify
from lariat.geometry.cable_routes import held_clips
from lariat.geometry.obstacle_motion import obstacles_at
from lariat.scenario import Scenario
from lariat.trajectory import NANOSECONDS, SECOND
from shared import topics
from shared.cell_checks import REQUIRED_SERVICES, CellChecks
from shared.messages import (
    ArmStates,
    Message,
    Parameters,
    Scene,
    SceneMotion,
    TaskState,
    chain,
    obstacle_motions,
    scene_obstacles,
)
from shared.runtime.service import Inbox

IDLE_PERIOD = SECOND
"""Time between two drawings while no browser is open [ns]."""
DRAW_PERIOD = SECOND // 20
"""Least time between two drawings of a live cell [ns]: every second step draws."""
PLAN_PERIOD = SECOND // 10
"""Least time between two drawings of the prediction [ns]."""
LEFT_PANEL_WIDTH, RIGHT_PANEL_WIDTH = 300, 420
"""Widths of the panels [pixels]."""
REFUSAL_GAP = 50
"""Gap between the sequence numbers of two refused setpoint chunks above which the second refusal is
reported too [-]; the controller sends this many chunks in a second."""


class Page:
    """Page of one web server; every method is called in the thread that steps."""

    def __init__(
        self, server: viser.ViserServer, scenario: Scenario, outbox: Outbox, live: bool = True
    ) -> None:
        icons.share_archive()
        self._server = server
        self._scenario = scenario
        self._outbox = outbox
        self.actions = ActionQueue()
        """What people have asked for since the last step."""
        self._uploads = Uploads(self.actions, self.notify)
        gui = server.gui
        gui.set_panel_label(f"Lariat · {scenario.name}")
        self._simulated = scenario.simulated
        self._run_controls = RunControls(
            gui,
            self.actions,
            outbox,
            live,
            self._simulated,
            lambda action, label: self._arm_controls.command(action, label),
        )
        self._scene = SceneView(
            server, scenario, lambda name: self._obstacle_editor.queue_selection(name)
        )
        with gui.add_folder("Goal", visible=live):
            self._goal_editor = GoalEditor(
                server,
                scenario,
                self.actions,
                outbox,
                self._scene,
                self._uploads,
                self._simulated,
            )
            self._goal_shortcuts = GoalShortcuts(gui, self.actions, outbox)
            self._saved_goals_folder = gui.add_folder("Saved goals", expand_by_default=False)
            with self._saved_goals_folder:
                self._saved_goals = SavedGoals(gui, scenario, self.actions, outbox)
        with gui.add_folder("Obstacles", expand_by_default=False, visible=live):
            self._obstacle_editor = ObstacleEditor(
                server, scenario, self.actions, outbox, self.notify
            )
        with gui.add_folder("Arms", expand_by_default=not self._simulated):
            self._arm_controls = ArmControls(gui, self.actions, outbox, live, self.notify)
        with gui.add_folder("View", expand_by_default=False):
            self._add_layers(gui)
        gui.main_panel.dock_left()
        gui.main_panel.set_width(LEFT_PANEL_WIDTH)
        panel = gui.add_panel()
        with panel.add_tab("Run"):
            several = len(scenario.camera_setups) > 1
            self._cameras = [
                CameraFeed(
                    camera.name,
                    CameraImage(server, camera.T_world_camera, camera.name if several else None),
                )
                for camera in scenario.camera_setups
            ]
            self._plots = RunPlots(gui, scenario)
        self._runs: RunsPanel | None = None
        self._scenarios: ScenarioPanel | None = None
        self._campaigns: CampaignPanel | None = None
        if live:
            with panel.add_tab("Runs"):
                self._runs = RunsPanel(server, scenario, self.actions, outbox, self.notify)
        self._checks = CellChecks(scenario)
        self._checks_panel: ChecksPanel | None = None
        self._control: ControlPanel | None = None
        if live:
            with panel.add_tab("Control"):
                self._control = ControlPanel(gui, scenario, self.actions, outbox)
        with panel.add_tab("Rope"):
            self._parameters = ParameterPanel(gui, scenario, self.actions, outbox, live)
        with panel.add_tab("Events"):
            self._events = EventsPanel(gui, self.actions)
        with panel.add_tab("Health"):
            self._health = HealthPanel(gui)
            if live:
                with gui.add_folder("Checks"):
                    self._checks_panel = ChecksPanel(gui, self._checks)
        if live:
            with panel.add_tab("Scenario"):
                self._scenarios = ScenarioPanel(
                    gui, scenario, self.actions, outbox, self.notify, self._uploads
                )
            with panel.add_tab("Campaign"):
                self._campaigns = CampaignPanel(
                    gui, scenario, self.actions, outbox, self.notify, self._scenarios.changes
                )
        panel.dock_right()
        panel.set_width(RIGHT_PANEL_WIDTH)
        self._light_windows: set[int] = set()
        """Windows whose theme is light, by their number."""
        self._live = live
        self._shortest_period = DRAW_PERIOD if live else 0
        self._draw_time = self._plan_time = 0
        self._undrawn: dict[str, Message] = {}
        self._refused_sequence = 0
        self._reset_count = 0
        self._obstacles = scenario.bodies
        self._motion = SceneMotion()
        self._obstacle_editor.update(scenario.bodies)
        self._goal_editor.take_scene(scenario.bodies)

    def _add_layers(self, gui: viser.GuiApi) -> None:
        for label, layer in LAYERS.items():
            box = gui.add_checkbox(label, layer not in INITIALLY_HIDDEN)
            self.actions.on_change(box, partial(self._scene.set_layer_visible, layer))
        coloring = gui.add_dropdown(
            "Rope's colour", COLORINGS, hint="What the seen rope's colour is"
        )
        self.actions.on_change(coloring, self._color_rope)
        frame = gui.add_button(
            "Frame everything", icon=viser.Icon.MAXIMIZE, hint="See start, goal and obstacles whole"
        )
        self.actions.on_press(frame, lambda client: show_whole(client, self._scenario))
        theme = gui.add_button(
            "Light or dark", icon=viser.Icon.SUN, hint="Switch the colours of this window"
        )
        self.actions.on_press(theme, self._switch_theme)
        self._legend = gui.add_html(legend_html(coloring.value))

    def _color_rope(self, coloring: Coloring) -> None:
        self._scene.coloring = coloring
        self._legend.content = legend_html(coloring)

    def _switch_theme(self, client: viser.ClientHandle) -> None:
        self._light_windows ^= {client.client_id}
        set_theme(client, light=client.client_id in self._light_windows)

    def notify(self, notification: Notification) -> None:
        """Show a notification in every open browser."""
        notify(self._server, notification.title, notification.body)

    def update(self, inbox: Inbox, now: int) -> None:
        """Take new messages and draw them."""
        task, task_age = latest_with_age(inbox, topics.TASK_STATE, now)
        arms = [r.message for r in inbox.every(topics.ARM_STATE)]
        scene, _ = latest_with_age(inbox, topics.SCENE_STATE, now)
        runs, _ = latest_with_age(inbox, topics.RUN_LIST, now)
        stack, _ = latest_with_age(inbox, topics.STACK_STATE, now)
        goals, _ = latest_with_age(inbox, topics.GOAL_LIST, now)
        for notification in self._outbox.notifications(now, task, scene, arms, runs, stack, goals):
            self.notify(notification)
        self._report_refused_setpoints(arms)
        self._events.take(inbox)
        self._feed_checks(inbox)
        for item in inbox.every(topics.TASK_STATE):
            self._plots.add(item.message)
            self._parameters.mark_run(item.message)
            self._forget_past_motion(item.message)
        if fresh := inbox.fresh(topics.CONTROLLER_PARAMETERS):
            self._parameters.add(fresh.message)
        if self._runs is not None:
            for item in inbox.every(topics.RUN_CURVES):
                self._runs.take_curves(item.message)
            if fresh := inbox.fresh(topics.RUN_MOTION):
                self._runs.opened.take_motion(fresh.message)
            if fresh := inbox.fresh(topics.RUN_PICTURE):
                self._runs.opened.take_picture(fresh.message)
            if fresh := inbox.fresh(topics.RUN_VIDEO):
                self._runs.video.take(fresh.message)
        # Kept until the next drawing: published rarely, or drawn less often than they come.
        for topic in (
            topics.SCENE_STATE,
            topics.SCENE_MOTION,
            topics.ROPE_NODES,
            topics.ROPE_TRUTH,
            topics.ROPE_OTHERS,
            topics.ARM_STATE,
            topics.CONTROLLER_PATH,
            topics.CONTROLLER_PLAN,
            topics.RUN_RESULT,
        ):
            if fresh := inbox.fresh(topic):
                self._undrawn[topic.key] = fresh.message
        for camera in self._cameras:
            camera.update(inbox, now)
        period = self._shortest_period if self._server.get_clients() else IDLE_PERIOD
        if 0 <= now - self._draw_time < period:
            return
        self._draw_time = now
        with self._server.atomic():
            self._draw(inbox, now, task, task_age)

    def _feed_checks(self, inbox: Inbox) -> None:
        for item in inbox.every(topics.ARM_STATE):
            self._checks.take_arms(item.message)
        for item in inbox.every(topics.TASK_STATE):
            self._checks.take_task(item.message)
        for name in REQUIRED_SERVICES:
            if fresh := inbox.fresh(HEALTHS[name]):
                self._checks.take_health(name, fresh.message)
        if fresh := inbox.fresh(topics.ROPE_NODES):
            self._checks.take_rope(fresh.message)

    def _draw(self, inbox: Inbox, now: int, task: TaskState | None, task_age: float) -> None:
        arms, arms_age = latest_with_age(inbox, topics.ARM_STATE, now)
        rope, _ = latest_with_age(inbox, topics.ROPE_NODES, now)
        preview, _ = latest_with_age(inbox, topics.TASK_GOAL_PREVIEW, now)
        missing = unheard(inbox) if self._live else ()
        route = task.goal.route if task is not None else ()
        nodes = chain(rope.positions) if rope is not None and not rope.lost else np.zeros((0, 3))
        held = held_clips(route, self._obstacles, nodes) if route and len(nodes) else []
        laid = status_text.laid(task, held, self._scenario.limits.tension) if route else ""
        path, _ = latest_with_age(inbox, topics.CONTROLLER_PATH, now)
        facts = laid, status_text.certain(path)
        headline = status_text.headline(task, task_age, arms, rope, missing, self._simulated, facts)
        self._arm_controls.update(arms, arms_age)
        self._run_controls.update(headline, task, arms, now)
        self._goal_editor.update(task, preview, now)
        self._goal_editor.route.mark(held)
        self._scene.mark_stops(self._goal_editor.route.route, held)
        editing = self._goal_editor.editing
        self._goal_shortcuts.update(task, rope, arms, editing)
        self._saved_goals_folder.visible = not editing
        self._saved_goals.update(latest_with_age(inbox, topics.GOAL_LIST, now)[0], task)
        self._draw_scene(now)
        if (scene := self._undrawn.pop(topics.SCENE_STATE.key, None)) is not None:
            self._take_scene(scene)
        if (motion := self._undrawn.pop(topics.SCENE_MOTION.key, None)) is not None:
            self._motion = motion
            self._show_obstacles()
        if (result := self._undrawn.pop(topics.RUN_RESULT.key, None)) is not None:
            self._plots.show_result(result)
        self._plots.draw(now / SECOND)
        self._parameters.update(task)
        if self._control is not None:
            self._control.update(task, now)
        self._parameters.draw(now / SECOND)
        if self._runs is not None:
            self._runs.update(latest_with_age(inbox, topics.RUN_LIST, now)[0], now)
        stack, age = latest_with_age(inbox, topics.STACK_STATE, now)
        launcher = stack if age < STALE_AGE else None
        if self._scenarios is not None:
            self._scenarios.update(launcher, task, self._obstacles)
        if self._campaigns is not None:
            self._campaigns.update(launcher, latest_with_age(inbox, topics.CAMPAIGN_STATE, now)[0])
        if self._checks_panel is not None:
            self._checks_panel.draw()
        self._events.draw(now)
        self._health.update(inbox, now)

    def _draw_scene(self, now: int) -> None:
        for topic, show in (
            (topics.ROPE_NODES, self._scene.show_rope),
            (topics.ROPE_TRUTH, self._scene.show_truth),
            (topics.ROPE_OTHERS, self._scene.show_others),
            (topics.CONTROLLER_PATH, self._scene.show_path),
            (topics.ARM_STATE, self._scene.show_arms),
        ):
            if (message := self._undrawn.pop(topic.key, None)) is not None:
                show(message)
        if now - self._plan_time >= PLAN_PERIOD and (
            plan := self._undrawn.pop(topics.CONTROLLER_PLAN.key, None)
        ):
            self._plan_time = now
            self._scene.show_plan(plan)
            self._plots.show_cost(plan, now / SECOND)

    def _forget_past_motion(self, task: TaskState) -> None:
        """Hide prediction and path once the rope has returned to its start."""
        if 0 < self._reset_count < task.reset_count:
            self._scene.hide_motion()
            self._undrawn.pop(topics.CONTROLLER_PLAN.key, None)
        self._reset_count = task.reset_count or self._reset_count

    def _take_scene(self, scene: Scene) -> None:
        try:
            obstacles = scene_obstacles(scene)
        except ValueError as error:
            self.notify(Notification("The scene cannot be drawn", str(error)))
            return
        if obstacles != self._obstacles:
            self._goal_editor.take_scene(obstacles)
        self._obstacles = obstacles
        self._show_obstacles()
        self._obstacle_editor.update(obstacles)

    def _show_obstacles(self) -> None:
        """Draw the obstacles, moving ones where they are at the stamp of the newest motion."""
        motions, stamp = obstacle_motions(self._motion), self._motion.stamp  # pyright: ignore[reportAttributeAccessIssue]
        self._scene.show_obstacles(obstacles_at(self._obstacles, motions, stamp * NANOSECONDS))

    def _report_refused_setpoints(self, arms: Sequence[ArmStates]) -> None:
        for state in arms:
            refused, previous = state.refused_sequence, self._refused_sequence
            self._refused_sequence = refused
            if refused and (
                previous == 0 or refused > previous + REFUSAL_GAP or refused < previous
            ):
                self.notify(
                    Notification("Motion refused by the gateway", f"{state.rule}: {state.reason}")
                )

    def clear_history(self) -> None:
        """Drop everything that was drawn over time, for a jump in a recording."""
        for camera in self._cameras:
            camera.clear()
        self._health.clear()
        self._events.clear()
        self._draw_time = self._plan_time = self._reset_count = 0
        self._plots.clear()
        self._parameters.clear()

    def hide_unknown(self, inbox: Inbox) -> None:
        """Hide what a jump in a recording has left of later moments."""
        self._scene.hide_all_but(lambda topic: inbox.latest(topic) is not None)

    def add_history(self, message: TaskState | Parameters) -> None:
        """Add a message from before the moment to which a recording jumped."""
        if isinstance(message, TaskState):
            self._plots.add(message)
            self._parameters.mark_run(message)
        else:
            self._parameters.add(message)

    def close(self) -> None:
        """Stop the page's threads."""
        self._uploads.close()
        for camera in self._cameras:
            camera.close()
