"""Three-dimensional view of a cell: ropes, grippers, path, obstacles, camera."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

import numpy as np
import viser
from jaxtyping import Bool, Float64

from dashboard import palette
from dashboard.palette import Color
from dashboard.scene import scene_setup
from dashboard.scene.arm_view import arm_view
from dashboard.scene.bending import bending_colors
from dashboard.scene.certainty import bead_radii, certainty_colors
from dashboard.scene.chain_lines import LinesView, chain_segments, dashed
from dashboard.scene.gripper_view import GripperView
from dashboard.scene.legend import Coloring
from dashboard.scene.obstacle_view import ObstacleView
from dashboard.scene.other_ropes_view import OtherRopesView
from dashboard.scene.tube_view import TubeView
from lariat.geometry.obstacles import Obstacle
from lariat.scenario import SIDES, Goal, Scenario
from shared import topics
from shared.messages import ArmStates, GoalPreview, NodeChain, OtherRopes, Path, Plan, chain
from shared.topics import Topic

PATH_ROPE_COUNT = 5
"""Number of ropes drawn along a path."""
PATH_ROPE_WEIGHT = 0.55
"""Opacity of the ropes along a path [-]."""
FIRST_PREDICTION_WEIGHT = 0.25
"""Opacity of the first predicted rope; the last one is opaque [-]."""
GOAL_RADIUS, PREVIEW_RADIUS, STRETCH_BEAD_RADIUS = 0.8, 0.9, 2.0
"""Radius of a goal, of its preview, and of the beads at the ends of what counts, relative to the
rope's [-]."""

LAYERS = {
    "Perceived rope": "rope",
    "Goal": "goal",
    "Prediction": "prediction",
    "Planned path": "path",
    "True rope (simulation)": "truth",
    "Obstacle names": "names",
    "Camera": "camera",
}
"""Layers that can be hidden, by the label of their checkbox."""
INITIALLY_HIDDEN = ("truth",)
"""Layers that are hidden until their checkbox is ticked."""


class SceneView:
    """Scene of a cell; each part is updated when its message arrives."""

    def __init__(
        self, server: viser.ViserServer, scenario: Scenario, on_click: Callable[[str], None]
    ) -> None:
        scene = server.scene
        self._radius = radius = scenario.rope.diameter / 2.0
        scene_setup.set_up(server, scenario)
        self._rope = TubeView(scene, "/rope", radius)
        self._truth = TubeView(scene, "/truth", 0.6 * radius)
        # Thinner than the rope, so that the rope covers it once it is there.
        self._goal = TubeView(scene, "/goal", GOAL_RADIUS * radius, opacity=0.7)
        self._others = OtherRopesView(scene)
        self._preview = TubeView(scene, "/preview", PREVIEW_RADIUS * radius, opacity=0.8)
        self._obstacles = ObstacleView(scene, on_click)
        self._regions = scenario.regions
        self.show_obstacles(scenario.bodies)
        self._prediction = LinesView(scene, "/prediction", thickness=2.0)
        self._path = LinesView(scene, "/path", thickness=1.5)
        self._grippers = {side: GripperView(scene, scenario, side) for side in SIDES}
        self._arms = {side: arm_view(scene, scenario, side) for side in SIDES}
        self._cameras = [scene_setup.add_camera(scene, c) for c in scenario.camera_setups]
        self.coloring: Coloring = "certainty"
        """Quantity by which the perceived rope is coloured."""
        for layer in INITIALLY_HIDDEN:
            self.set_layer_visible(layer, False)

    def set_layer_visible(self, layer: str, visible: bool) -> None:
        """Show or hide one of `LAYERS`."""
        match layer:
            case "rope":
                self._rope.visible = self._others.visible = visible
            case "goal":
                self._goal.visible = visible
            case "truth":
                self._truth.visible = visible
            case "names":
                self._obstacles.show_names(visible)
            case "camera":
                for camera in self._cameras:
                    camera.visible = visible
            case "prediction":
                self._prediction.visible = visible
            case "path":
                self._path.visible = visible

    def show_rope(self, message: NodeChain) -> None:
        """Draw the perceived rope, with beads by the certainty of its nodes."""
        nodes = chain(message.positions)
        if message.lost or len(nodes) < 2:
            self._rope.hide()
            return
        by_certainty = self.coloring == "certainty"
        colors = certainty_colors(message) if by_certainty else bending_colors(nodes)
        self._rope.show(nodes, colors, bead_radii(message, self._radius))

    def show_others(self, message: OtherRopes) -> None:
        """Draw the ropes beside the held one."""
        self._others.show(message)

    def show_truth(self, message: NodeChain) -> None:
        """Draw the simulated true rope."""
        nodes = chain(message.positions)
        if self._truth.visible and len(nodes) > 1:
            self._truth.show(nodes, palette.TRUTH)

    def show_goal(self, goal: Goal) -> None:
        """Draw the goal: what of it counts, or its ends with a free shape between them."""
        nodes = goal.curve
        if len(nodes) > 1:
            counted = goal.counted if len(nodes) == len(goal.nodes) else None
            self._show_counted(self._goal, GOAL_RADIUS, nodes, palette.GOAL, counted)
        else:
            self._goal.hide()

    def show_preview(
        self, message: GoalPreview | None, counted: Bool[np.ndarray, "n"] | None = None
    ) -> None:
        """Draw the rod at rest between dragged grips."""
        nodes = chain(message.goal.positions) if message is not None else np.zeros((0, 3))
        if message is None or len(nodes) < 2:
            self._preview.hide()
            return
        color = palette.GOAL if message.reachable else palette.UNREACHABLE
        self._show_counted(self._preview, PREVIEW_RADIUS, nodes, color, counted)

    def _show_counted(
        self,
        tube: TubeView,
        radius: float,
        nodes: Float64[np.ndarray, "n 3"],
        color: Color,
        counted: Bool[np.ndarray, "n"] | None,
    ) -> None:
        """Draw a shape: beads stand at the ends of what counts, the rest is grey."""
        if counted is None or np.all(counted):
            tube.show(nodes, color)
            return
        colors = np.where(counted[:, None], color, palette.FREE).astype(np.uint8)
        radii = np.full(len(nodes), radius * self._radius)
        radii[np.flatnonzero(counted)[[0, -1]]] = STRETCH_BEAD_RADIUS * self._radius
        tube.show(nodes, colors, radii)

    def show_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Draw the obstacles of the scene, and the scenario's regions."""
        self._obstacles.show((*obstacles, *self._regions))

    def mark_stops(self, route: Sequence[str], held: Collection[str]) -> None:
        """Number the clips and pegs of a route, and mark those that hold the cable."""
        self._obstacles.mark(route, held)

    def show_plan(self, message: Plan) -> None:
        """Draw the predicted ropes of the horizon."""
        if not message.nodes or not message.node_count:
            return
        ropes = chain(message.nodes).reshape(-1, message.node_count, 3)
        weights = np.linspace(FIRST_PREDICTION_WEIGHT, 1.0, len(ropes))
        self._prediction.show(*chain_segments(ropes, weights, palette.PREDICTION))

    def show_path(self, message: Path) -> None:
        """Draw the planned path of both grips, and a few ropes along it."""
        grips = [chain(message.left_positions), chain(message.right_positions)]
        segments = [dashed(g) for g in grips if len(g) > 1]
        path_color = np.uint8(palette.linear(palette.PATH))
        colors = [np.broadcast_to(path_color, s.shape) for s in segments]
        if message.nodes and message.node_count:
            ropes = chain(message.nodes).reshape(-1, message.node_count, 3)
            chosen = np.unique(np.linspace(0, len(ropes) - 1, PATH_ROPE_COUNT + 2).astype(int))
            ropes = ropes[chosen[1:-1]]
            weights = np.full(len(ropes), PATH_ROPE_WEIGHT)
            rope_segments, rope_colors = chain_segments(ropes, weights, palette.PATH)
            segments.append(rope_segments)
            colors.append(rope_colors)
        if segments:
            self._path.show(np.concatenate(segments), np.concatenate(colors))

    def hide_motion(self) -> None:
        """Hide prediction and path until the next ones."""
        self._prediction.hide()
        self._path.hide()

    def hide_all_but(self, is_known: Callable[[Topic], bool]) -> None:
        """Hide ropes, prediction and path of which nothing is known, until something is."""
        for topic, view in (
            (topics.ROPE_NODES, self._rope),
            (topics.ROPE_TRUTH, self._truth),
            (topics.CONTROLLER_PLAN, self._prediction),
            (topics.CONTROLLER_PATH, self._path),
        ):
            if not is_known(topic):
                view.hide()

    def show_arms(self, message: ArmStates) -> None:
        """Draw the grippers and the arms where the gateway reports them."""
        for arm in message.arms:
            view = self._arms.get(arm.arm)
            if view is not None:
                view.update(np.array(arm.joints))
            if arm.arm in self._grippers and len(arm.position) == 3:
                self._grippers[arm.arm].update(
                    list(arm.position), list(arm.orientation), arm.gripper_closed
                )
