"""Drawing of the cell for viewers such as Foxglove: rope, prediction, goal, obstacles, grippers."""

from __future__ import annotations

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.CylinderPrimitive_pb2 import CylinderPrimitive
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.Pose_pb2 import Pose as PoseMessage
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from shared import topics
from shared.messages import ArmStates, arm_pose, chain, scene_obstacles, timestamp
from shared.scenario import SIDES, Scenario

WORLD_FRAME = "world"
"""Name of the frame of all entities."""
ROPE_COLOR = Color(r=1.0, g=0.62, b=0.1, a=1.0)
PREDICTION_COLOR = Color(r=0.2, g=0.75, b=1.0, a=0.8)
GOAL_COLOR = Color(r=0.25, g=0.85, b=0.35, a=0.9)
OBSTACLE_COLOR = Color(r=0.6, g=0.62, b=0.68, a=0.9)
SUPPORT_COLOR = Color(r=0.62, g=0.55, b=0.45, a=0.6)
GRIPPER_COLOR = Color(r=0.85, g=0.2, b=0.3, a=1.0)
HALF_SPACE_SIDE = 2.0
"""Side of the square drawn for a half space [m]."""
HALF_SPACE_THICKNESS = 1e-3
"""Thickness of that square [m]."""
DRAWN_TOPICS = (
    topics.ROPE_NODES,
    topics.TASK_STATE,
    topics.SCENE_STATE,
    topics.CONTROLLER_PLAN,
    topics.ARM_STATE,
)
"""Topics that are drawn."""


class FoxgloveScene:
    """Newest messages of the drawn topics, and their drawing."""

    def __init__(self, scenario: Scenario) -> None:
        self._thickness = scenario.rope.diameter
        self._gripper = (scenario.limits.gripper_radius, scenario.limits.gripper_height)
        self._types = {topic.key: topic.type for topic in DRAWN_TOPICS}
        self._newest: dict[str, bytes] = {}

    def take(self, key: str, payload: bytes) -> None:
        """Take an encoded message of any topic."""
        if key in self._types:
            self._newest[key] = payload

    def draw(self, now: int) -> SceneUpdate:
        """Draw the newest messages; the entities are stamped with `now` [ns]."""
        update = SceneUpdate()
        newest = {key: self._types[key].FromString(p) for key, p in self._newest.items()}
        entities = {key: self._entity(update, key, now) for key in ("rope", "goal", "prediction")}
        if rope := newest.get(topics.ROPE_NODES.key):
            self._line(entities["rope"], chain(rope.positions), ROPE_COLOR)
        if task := newest.get(topics.TASK_STATE.key):
            self._line(entities["goal"], chain(task.goal.positions), GOAL_COLOR)
        if (plan := newest.get(topics.CONTROLLER_PLAN.key)) and plan.node_count:
            self._line(
                entities["prediction"], chain(plan.nodes)[-plan.node_count :], PREDICTION_COLOR
            )
        if scene := newest.get(topics.SCENE_STATE.key):
            entity = self._entity(update, "obstacles", now)
            for obstacle in scene_obstacles(scene):
                _add_obstacle(entity, obstacle)
        if arms := newest.get(topics.ARM_STATE.key):
            self._add_grippers(self._entity(update, "grippers", now), arms)
        return update

    def _entity(self, update: SceneUpdate, name: str, now: int) -> SceneEntity:
        # An entity replaces the previous one of its id.
        return update.entities.add(timestamp=timestamp(now), frame_id=WORLD_FRAME, id=name)

    def _line(self, entity: SceneEntity, nodes: Float64[np.ndarray, "n 3"], color: Color) -> None:
        if len(nodes):
            entity.lines.add(
                type=LinePrimitive.LINE_STRIP,
                pose=_pose(Pose(np.zeros(3), poses.IDENTITY)),
                thickness=self._thickness,
                points=[Point3(x=x, y=y, z=z) for x, y, z in nodes.tolist()],
                color=color,
            )

    def _add_grippers(self, entity: SceneEntity, arms: ArmStates) -> None:
        radius, height = self._gripper
        # The grips' z axes run along the rope from left to right; grippers point away from it.
        for side, away in zip(SIDES, (-1.0, 1.0), strict=True):
            if not any(a.arm == side and len(a.position) == 3 for a in arms.arms):
                continue
            grip = arm_pose(arms, side)
            middle = grip.apply(np.array([0.0, 0.0, away * height / 2.0]))
            entity.cylinders.append(
                _cylinder(Pose(middle, grip.orientation), radius, height, GRIPPER_COLOR)
            )


def _add_obstacle(entity: SceneEntity, obstacle: Obstacle) -> None:
    pose = Pose(np.array(obstacle.position), np.array(obstacle.orientation))
    color = SUPPORT_COLOR if obstacle.support else OBSTACLE_COLOR
    match obstacle.shape:
        case "box":
            entity.cubes.append(_box(pose, obstacle.size, color))
        case "sphere":
            entity.spheres.append(_sphere(pose, obstacle.radius, color))
        case "cylinder":
            entity.cylinders.append(_cylinder(pose, obstacle.radius, obstacle.height, color))
        case "capsule":
            entity.cylinders.append(_cylinder(pose, obstacle.radius, obstacle.height, color))
            for end in (-0.5, 0.5):
                cap = pose.apply(np.array([0.0, 0.0, end * obstacle.height]))
                entity.spheres.append(_sphere(Pose(cap, pose.orientation), obstacle.radius, color))
        case "half_space":
            up = poses.normalized(np.array(obstacle.normal))
            turn = poses.rotation_between(np.array([0.0, 0.0, 1.0]), up)
            below = Pose(pose.position, poses.multiply(pose.orientation, turn))
            center = below.apply(np.array([0.0, 0.0, -HALF_SPACE_THICKNESS / 2.0]))
            size = (HALF_SPACE_SIDE, HALF_SPACE_SIDE, HALF_SPACE_THICKNESS)
            entity.cubes.append(_box(Pose(center, below.orientation), size, SUPPORT_COLOR))


def _box(pose: Pose, size: tuple[float, float, float], color: Color) -> CubePrimitive:
    x, y, z = size
    return CubePrimitive(pose=_pose(pose), size=Vector3(x=x, y=y, z=z), color=color)


def _sphere(pose: Pose, radius: float, color: Color) -> SpherePrimitive:
    size = Vector3(x=2.0 * radius, y=2.0 * radius, z=2.0 * radius)
    return SpherePrimitive(pose=_pose(pose), size=size, color=color)


def _cylinder(pose: Pose, radius: float, height: float, color: Color) -> CylinderPrimitive:
    return CylinderPrimitive(
        pose=_pose(pose),
        size=Vector3(x=2.0 * radius, y=2.0 * radius, z=height),
        bottom_scale=1.0,
        top_scale=1.0,
        color=color,
    )


def _pose(pose: Pose) -> PoseMessage:
    x, y, z = pose.position.tolist()
    qw, qx, qy, qz = pose.orientation.tolist()
    return PoseMessage(
        position=Vector3(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw)
    )
