"""View of a cell: newest messages of the drawn topics, and their drawing for viewers.

Each kind of thing is drawn when its message has changed, and everything once a second, for viewers
that come late.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from lariat.geometry import poses
from lariat.geometry.obstacle_motion import obstacles_at
from lariat.geometry.poses import Pose
from lariat.scenario import SIDES, Scenario
from lariat.trajectory import NANOSECONDS, SECOND
from services.recorder.view import colors
from services.recorder.view.curves import CURVES, curves
from services.recorder.view.depth_view import DepthView
from services.recorder.view.mesh_hulls import mesh_hulls
from services.recorder.view.point_clouds import point_cloud
from services.recorder.view.primitives import (
    add_body,
    add_curves,
    add_hull,
    add_link_body,
    add_obstacle,
)
from services.recorder.view.surfaces import surface_points
from shared import topics
from shared.cell_description import (
    ARM_COLOR,
    AWAY_FROM_ROPE,
    GRIP,
    GRIPPER_COLOR,
    WORLD_FRAME,
    arm_urdf,
    frame_name,
)
from shared.frames import Frames
from shared.messages import Scene, SceneMotion, obstacle_motions, scene_obstacles, timestamp
from shared.runtime.service import Publication
from shared.topics import Topic

REFRESH_PERIOD = SECOND
"""Time after which everything is drawn again [ns]."""
CURVE_PERIOD = SECOND // 16
"""Least time between two drawings of the curves [ns]."""
THIN_LINE = 0.25
"""Thickness of the prediction and the path in diameters of the rope [-]."""
_THIN = ("prediction", "path")
_OBSTACLES = topics.VIEW_POINTS.at("obstacles")
_CLOUDS = {key: topics.VIEW_POINTS.at(name) for key, name in CURVES.items()}
WRITES: tuple[Topic, ...] = (
    topics.VIEW_SCENE,
    topics.VIEW_TRANSFORMS,
    topics.VIEW_JOINTS,
    *_CLOUDS.values(),
    _OBSTACLES,
)
"""Topics of the drawing, beside those of the cameras."""
_TYPES = {
    topic.key: topic.type
    for topic in (
        topics.ROPE_NODES,
        topics.ROPE_TRUTH,
        topics.TASK_STATE,
        topics.CONTROLLER_PLAN,
        topics.CONTROLLER_PATH,
        topics.SCENE_STATE,
        topics.SCENE_MOTION,
        topics.ARM_STATE,
    )
}
"""Type of each drawn topic by its key, beside those of the cameras."""


class CellView:
    """Newest messages of the drawn topics, and their drawing."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._frames = Frames(scenario)
        self._arms = {side: arm_urdf(scenario, side) for side in SIDES}
        self._hulls = {side: mesh_hulls(scenario, side) for side in SIDES}
        self._cameras = [DepthView(camera.name) for camera in scenario.camera_setups]
        self.writes = (*WRITES, *(camera.cloud for camera in self._cameras))
        self._newest: dict[str, bytes] = {}
        self._changed: set[str] = set()
        self._refreshed = self._curves_drawn = -REFRESH_PERIOD

    def take(self, key: str, payload: bytes) -> None:
        """Take an encoded message of any topic."""
        if key in _TYPES:
            self._newest[key] = payload
            self._changed.add(key)
        for camera in self._cameras:
            camera.take(key, payload)

    def draw(self, now: int) -> Iterator[Publication]:
        """Draw what has changed; the drawing is stamped with `now` [ns]."""
        refresh = now - self._refreshed >= REFRESH_PERIOD
        changed = set(self._newest) if refresh else self._changed
        self._changed = set()
        scene = SceneUpdate()
        if refresh or now - self._curves_drawn >= CURVE_PERIOD:
            self._curves_drawn = now
            for key in (k for k in CURVES if k in changed):
                yield self._draw_curves(key, scene, now)
        else:
            self._changed = changed & CURVES.keys()
        if {topics.SCENE_STATE.key, topics.SCENE_MOTION.key} & changed:
            yield self._draw_obstacles(scene, now)
        if refresh:
            self._refreshed = now
            self._draw_arms(scene, now)
        arms = self._message(topics.ARM_STATE.key) if topics.ARM_STATE.key in changed else None
        if arms or refresh:
            yield Publication(
                topics.VIEW_TRANSFORMS, self._frames.transforms(arms, now, fixed=refresh)
            )
        if arms and (joints := self._frames.joints(arms, now)).joints:
            yield Publication(topics.VIEW_JOINTS, joints)
        if scene.entities:
            yield Publication(topics.VIEW_SCENE, scene)
        for camera in self._cameras:
            yield from camera.draw(now, again=refresh)

    def _message(self, key: str) -> Any | None:
        payload = self._newest.get(key)
        return None if payload is None else _TYPES[key].FromString(payload)

    def _draw_curves(self, key: str, scene: SceneUpdate, now: int) -> Publication:
        drawn = curves(self._message(key), key)
        name = CURVES[key]
        thickness = self._scenario.rope.diameter * (THIN_LINE if name in _THIN else 1.0)
        add_curves(_entity(scene, name, WORLD_FRAME, now), drawn, thickness)
        return Publication(_CLOUDS[key], point_cloud(drawn.points, drawn.colors, WORLD_FRAME, now))

    def _draw_obstacles(self, scene: SceneUpdate, now: int) -> Publication:
        entity = _entity(scene, "obstacles", WORLD_FRAME, now)
        points, shades = [np.zeros((0, 3))], [np.zeros((0, 4))]
        motion = self._message(topics.SCENE_MOTION.key) or SceneMotion()
        standing = scene_obstacles(self._message(topics.SCENE_STATE.key) or Scene())
        present = obstacles_at(standing, obstacle_motions(motion), motion.stamp * NANOSECONDS)
        for obstacle in present:
            add_obstacle(entity, obstacle)
            points.append(surface_points(obstacle))
            color = colors.SUPPORT if obstacle.support else colors.OBSTACLE
            shades.append(colors.uniform(color, len(points[-1])))
        for region in self._scenario.regions:
            add_obstacle(entity, region)
        cloud = point_cloud(np.concatenate(points), np.concatenate(shades), WORLD_FRAME, now)
        return Publication(_OBSTACLES, cloud)

    def _draw_arms(self, scene: SceneUpdate, now: int) -> None:
        limits = self._scenario.limits
        for side in SIDES:
            grip = _entity(scene, frame_name(side, GRIP), frame_name(side, GRIP), now)
            middle = np.array([0.0, 0.0, AWAY_FROM_ROPE[side] * limits.gripper_height / 2.0])
            size = (limits.gripper_radius, limits.gripper_height)
            add_body(grip, Pose(middle, poses.IDENTITY), "cylinder", size, GRIPPER_COLOR)
            arm = self._arms[side]
            for body in arm.bodies if arm else ():
                frame = frame_name(side, body.link)
                add_link_body(_entity(scene, frame, frame, now), body, ARM_COLOR)
            for hull in self._hulls[side]:
                frame = frame_name(side, hull.link)
                add_hull(_entity(scene, f"{frame}/hull", frame, now), hull, ARM_COLOR)


def _entity(scene: SceneUpdate, name: str, frame: str, now: int) -> SceneEntity:
    # An entity replaces the previous one of its id; a locked one moves with its frame.
    return scene.entities.add(
        timestamp=timestamp(now), frame_id=frame, id=name, frame_locked=frame != WORLD_FRAME
    )
