"""The three-dimensional view: ropes, grippers, path, obstacles, camera."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import viser
from jaxtyping import Float64, UInt8

from dashboard import palette
from dashboard.scene import meshes
from dashboard.scene.obstacle_view import ObstacleView
from dashboard.scene.tube_view import TubeView
from lariat.geometry import poses
from lariat.geometry.cameras import looking_at
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from shared.messages import ArmStates, GoalPreview, NodeChain, Path, Plan, chain
from shared.scenario import SIDES, Scenario

VAGUE_SIGMA = 0.01
"""Standard deviation that is drawn in full warning colour [m]."""
GHOSTS = 5
"""Ropes drawn along a path."""
LAYERS = {
    "Rope as seen": "rope",
    "Goal": "goal",
    "Prediction": "prediction",
    "Path": "path",
    "True rope (simulation)": "truth",
    "Names": "names",
    "Camera": "camera",
}
HIDDEN_AT_FIRST = ("truth",)


class Look(NamedTuple):
    """Where a browser's camera stands at first."""

    position: Float64[np.ndarray, "3"]
    """[m]"""
    target: Float64[np.ndarray, "3"]
    """A point in the middle of the picture [m]."""
    field_of_view: float
    """Vertical [rad]."""


class SceneView:
    """Everything that is drawn in space, each part updated when its message comes."""

    def __init__(
        self, server: viser.ViserServer, scenario: Scenario, on_click: Callable[[str], None]
    ) -> None:
        """Args:
        on_click: Called with the name of a clicked obstacle.
        """
        self._scene = server.scene
        self._scenario = scenario
        radius = scenario.rope.diameter / 2.0
        _furnish(server, scenario)
        self._rope = TubeView(self._scene, "/rope", radius)
        self._truth = TubeView(self._scene, "/truth", 0.6 * radius)
        # Thinner than the rope, which hides it where it has reached it.
        self._goal = TubeView(self._scene, "/goal", 0.8 * radius, opacity=0.7)
        self._preview = TubeView(self._scene, "/preview", 0.9 * radius, opacity=0.8)
        self._obstacles = ObstacleView(self._scene, on_click)
        self._obstacles.show(scenario.bodies)
        self._prediction: viser.LineSegmentsHandle | None = None
        self._path: viser.LineSegmentsHandle | None = None
        self._grippers = {side: _Gripper(self._scene, scenario, side) for side in SIDES}
        self._camera = _camera(self._scene, scenario)
        self._shown = {layer: layer not in HIDDEN_AT_FIRST for layer in LAYERS.values()}
        self._truth.visible = self._shown["truth"]

    def layer(self, name: str, visible: bool) -> None:
        """Shows or hides one of `LAYERS`."""
        self._shown[name] = visible
        match name:
            case "rope":
                self._rope.visible = visible
            case "goal":
                self._goal.visible = visible
            case "truth":
                self._truth.visible = visible
            case "names":
                self._obstacles.label(visible)
            case "camera":
                self._camera.visible = visible
            case "prediction" if self._prediction is not None:
                self._prediction.visible = visible
            case "path" if self._path is not None:
                self._path.visible = visible

    def rope(self, message: NodeChain) -> None:
        """What perception sees."""
        nodes = chain(message.positions)
        if message.lost or len(nodes) < 2:
            self._rope.hide()
            return
        self._rope.show(nodes, certainty_colors(message))

    def truth(self, message: NodeChain) -> None:
        """What the simulation knows."""
        nodes = chain(message.positions)
        if self._shown["truth"] and len(nodes) > 1:
            self._truth.show(nodes, palette.TRUTH)

    def goal(self, nodes: Float64[np.ndarray, "n 3"]) -> None:
        """The wanted shape."""
        if len(nodes) > 1:
            self._goal.show(nodes, palette.GOAL)
        else:
            self._goal.hide()

    def preview(self, message: GoalPreview | None) -> None:
        """The rod at rest between dragged grips; None ends it."""
        nodes = chain(message.goal.positions) if message is not None else np.zeros((0, 3))
        if message is None or len(nodes) < 2:
            self._preview.hide()
            return
        self._preview.show(nodes, palette.GOAL if message.reachable else palette.REFUSED)

    def obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """What perception says is there."""
        self._obstacles.show(obstacles)

    def plan(self, message: Plan) -> None:
        """What the controller expects of the next moments, the later the brighter."""
        if not message.nodes or not message.node_count:
            return
        ropes = chain(message.nodes).reshape(-1, message.node_count, 3)
        weights = np.linspace(0.25, 1.0, len(ropes))
        self._prediction = _lines(
            self._scene, "/prediction", self._prediction, *_strands(ropes, weights), 2.0
        )
        self._prediction.visible = self._shown["prediction"]

    def path(self, message: Path) -> None:
        """Where the planner leads both grips, with a few ropes along the way."""
        grips = [chain(message.left_positions), chain(message.right_positions)]
        segments = [np.stack([g[:-1], g[1:]], axis=1) for g in grips if len(g) > 1]
        colors = [np.broadcast_to(np.uint8(palette.unlit(palette.PATH)), s.shape) for s in segments]
        if message.nodes and message.node_count:
            ropes = chain(message.nodes).reshape(-1, message.node_count, 3)
            chosen = np.unique(np.linspace(0, len(ropes) - 1, GHOSTS + 2).astype(int))[1:-1]
            ghosts, dim = _strands(ropes[chosen], np.full(len(chosen), 0.55), palette.PATH)
            segments.append(ghosts)
            colors.append(dim)
        if not segments:
            return
        self._path = _lines(
            self._scene, "/path", self._path, np.concatenate(segments), np.concatenate(colors), 1.5
        )
        self._path.visible = self._shown["path"]

    def arms(self, message: ArmStates) -> None:
        """Where the grippers are."""
        for arm in message.arms:
            if arm.arm in self._grippers and len(arm.position) == 3:
                self._grippers[arm.arm].move(
                    np.array(arm.position), np.array(arm.orientation), arm.gripper_closed
                )


class _Gripper:
    """One end's gripper as the capsule that the safety rules see, with two jaws at the clamp."""

    def __init__(self, scene: viser.SceneApi, scenario: Scenario, side: str) -> None:
        end, limits = scenario.end(side), scenario.limits
        away = -1.0 if side == "left" else 1.0
        fixed = end.driver == "fixed"
        color = palette.QUIET if fixed else palette.BRAND
        pose = scenario.grips(scenario.start)[SIDES.index(side)]
        self._frame = scene.add_frame(
            f"/grippers/{side}", show_axes=False, position=pose.position, wxyz=pose.orientation
        )
        body = meshes.capsule(limits.gripper_radius, limits.gripper_height)
        scene.add_mesh_simple(
            f"/grippers/{side}/body",
            *body,
            color=color,
            opacity=0.85,
            position=(0.0, 0.0, away * limits.gripper_height / 2.0),
        )
        rope = scenario.rope
        edge = rope.length / (rope.node_count - 1)
        self._gap = rope.diameter / 2.0 + 0.0025
        self._jaws = [
            scene.add_box(
                f"/grippers/{side}/jaw{k}",
                color=(206, 213, 224),
                dimensions=(0.012, 0.005, max(edge, 0.008)),
                position=(0.0, sign * self._gap, -away * edge / 2.0),
            )
            for k, sign in enumerate((-1.0, 1.0))
        ]
        self._closed = True
        scene.add_label(
            f"/grippers/{side}/name",
            f"{side} (fixed)" if fixed else f"{side} · {end.driver}",
            position=(0.0, 0.0, away * (limits.gripper_height + 0.03)),
            font_screen_scale=0.8,
            anchor="center-center",
        )

    def move(self, position: np.ndarray, orientation: np.ndarray, closed: bool) -> None:
        """Puts the gripper where the gateway says that it is."""
        self._frame.position = position
        self._frame.wxyz = orientation
        if closed != self._closed:
            self._closed = closed
            for jaw, sign in zip(self._jaws, (-1.0, 1.0), strict=True):
                x, _, z = jaw.position
                jaw.position = (x, sign * (self._gap + (0.0 if closed else 0.012)), z)


def certainty_colors(message: NodeChain) -> UInt8[np.ndarray, "n 3"]:
    """Rope colour where a node is seen well, warning where it is vague, grey where unseen."""
    count = len(message.positions) // 3
    sigma = np.array(message.sigma) if len(message.sigma) == count else np.zeros(count)
    vague = np.clip(sigma / VAGUE_SIGMA, 0.0, 1.0)[:, None]
    colors = (1.0 - vague) * np.array(palette.ROPE) + vague * np.array(palette.VAGUE)
    if len(message.observed) == count:
        colors[~np.array(message.observed)] = palette.BRIDGED
    return colors.round().astype(np.uint8)


def _furnish(server: viser.ViserServer, scenario: Scenario) -> None:
    """Background, light and the first look at the cell."""
    scene = server.scene
    scene.set_up_direction("+z")
    shade = np.linspace(0.0, 1.0, 128)[:, None, None]
    background = (1.0 - shade) * np.array(palette.SKY) + shade * np.array(palette.GROUND)
    scene.set_background_image(
        np.repeat(background, 4, axis=1).round().astype(np.uint8), format="png"
    )
    # The library's own lights bleach every colour.
    scene.configure_default_lights(enabled=False)
    scene.configure_environment_map(None)
    scene.add_light_hemisphere(
        "/light/sky", sky_color=(214, 226, 255), ground_color=(70, 74, 84), intensity=1.7
    )
    scene.add_light_directional(
        "/light/lamp", intensity=2.0, position=(0.8, -1.0, 2.2), cast_shadow=True
    )
    look = first_look(scenario)
    server.initial_camera.position = look.position
    server.initial_camera.look_at = look.target
    server.initial_camera.fov = look.field_of_view


def first_look(scenario: Scenario) -> Look:
    """From in front and above, with start, goal and obstacles in view."""
    grips = [g.position for s in (scenario.start, scenario.goal) for g in scenario.grips(s)]
    bodies = [b.position for b in scenario.bodies if b.shape != "half_space"]
    points = np.array(grips + bodies)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    size = max(float(np.linalg.norm(np.ptp(points, axis=0))), 0.5 * scenario.rope.length)
    return Look(
        position=middle + size * np.array([0.88, -1.3, 0.8]),
        target=middle - np.array([0.0, 0.0, 0.08 * size]),
        field_of_view=float(np.deg2rad(42.0)),
    )


def camera_pose(scenario: Scenario) -> Pose:
    """T_world_camera of the scenario's camera."""
    eye, target = scenario.sensing.position, scenario.sensing.look_at
    down = poses.normalized(np.subtract(target, eye))
    # Upwards in the image is z, or y for a camera that looks straight down.
    up = (0.0, 0.0, 1.0) if abs(down[2]) < 0.999 else (0.0, 1.0, 0.0)
    return looking_at(eye, target, up)


def _camera(scene: viser.SceneApi, scenario: Scenario) -> viser.CameraFrustumHandle:
    sensing = scenario.sensing
    pose = camera_pose(scenario)
    width, height = sensing.resolution
    half = np.tan(np.deg2rad(sensing.field_of_view) / 2.0) * height / width
    return scene.add_camera_frustum(
        "/camera",
        fov=2.0 * float(np.arctan(half)),
        aspect=width / height,
        scale=0.06,
        color=palette.CAMERA,
        thickness=0.002,
        position=pose.position,
        wxyz=pose.orientation,
    )


def _strands(
    ropes: Float64[np.ndarray, "k n 3"],
    weights: Float64[np.ndarray, "k"],
    color: palette.Color = palette.PREDICTION,
) -> tuple[Float64[np.ndarray, "m 2 3"], UInt8[np.ndarray, "m 2 3"]]:
    """Ropes as line segments whose colour fades into the background with a small weight."""
    segments = np.stack([ropes[:, :-1], ropes[:, 1:]], axis=2)
    w = weights[:, None]
    near, far = palette.unlit(color), palette.unlit(palette.TABLE)
    faded = w * np.array(near) + (1.0 - w) * np.array(far)
    colors = np.broadcast_to(faded[:, None, None], segments.shape)
    return segments.reshape(-1, 2, 3), colors.reshape(-1, 2, 3).round().astype(np.uint8)


def _lines(
    scene: viser.SceneApi,
    name: str,
    handle: viser.LineSegmentsHandle | None,
    points: Float64[np.ndarray, "m 2 3"],
    colors: UInt8[np.ndarray, "m 2 3"],
    thickness: float,
) -> viser.LineSegmentsHandle:
    """Assigns to the handle where there is one, else makes it."""
    if handle is None:
        return scene.add_line_segments(
            name, points, colors, thickness=thickness, thickness_units="screen"
        )
    handle.points = points.astype(np.float32)
    if not np.array_equal(handle.colors, colors):
        handle.colors = colors
    return handle
