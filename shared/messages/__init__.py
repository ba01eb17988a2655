"""Messages of the bus, and their conversion to arrays, poses and obstacles.

The `.proto` files of this folder document every field. Stamps are integer nanoseconds, quantities
are SI, quaternions are wxyz, lists of points are flat (x, y, z of one point after the other).
"""

# The generated modules hold messages and their enums only.
# ruff: noqa: F403, F405

from __future__ import annotations

from typing import Any

import numpy as np
from google.protobuf.message import Message as Message
from google.protobuf.timestamp_pb2 import Timestamp
from jaxtyping import Float64

from lariat.geometry import obstacle_motion
from lariat.geometry import obstacles as geometry
from lariat.geometry.poses import Pose
from lariat.scenario.sections import goal as scenario_goal
from lariat.shapes import SHAPES
from lariat.trajectory import NANOSECONDS
from shared.messages.arm_pb2 import *
from shared.messages.control_pb2 import *
from shared.messages.rope_pb2 import *
from shared.messages.runs_pb2 import *
from shared.messages.scene_pb2 import *
from shared.messages.system_pb2 import *
from shared.messages.task_pb2 import *


def chain(flat: object) -> Float64[np.ndarray, "n 3"]:
    """Return the points of a flat message field [m]."""
    return np.asarray(flat, dtype=np.float64).reshape(-1, 3)


def goal_message(goal: scenario_goal.Goal) -> Goal:
    """Return the message of a goal."""
    return Goal(
        positions=goal.nodes.ravel().tolist(),
        left=grip(goal.left),
        right=grip(goal.right),
        left_oriented=goal.left_oriented,
        right_oriented=goal.right_oriented,
        **goal.terms,
    )


def goal_of(message: Goal) -> scenario_goal.Goal:
    """Return the goal of a message; what the message lacks of nodes and grips is empty."""
    terms = {name: getattr(message, name) for name in scenario_goal.TERMS}
    return scenario_goal.Goal(
        chain(message.positions),
        grip_pose(message.left),
        grip_pose(message.right),
        message.left_oriented,
        message.right_oriented,
        **terms | {"part": tuple(message.part) or None, "route": tuple(message.route)},
    )


def grip(pose: Pose) -> Grip:
    """Return the message of a gripper pose."""
    return Grip(position=pose.position, orientation=pose.orientation)


def grip_pose(message: Grip) -> Pose:
    """Return the gripper pose of a message."""
    return Pose(np.array(message.position[:]), np.array(message.orientation[:]))


def arm_pose(states: ArmStates, arm: str) -> Pose:
    """Return the grip pose of an arm.

    Raises:
        KeyError: The cell has no such arm.
    """
    state = arm_state(states, arm)
    # Sliced into lists, of which NumPy makes arrays of few numbers ten times as fast.
    return Pose(np.array(state.position[:]), np.array(state.orientation[:]))


def arm_state(states: ArmStates, arm: str) -> ArmState:
    """Return the state of an arm.

    Raises:
        KeyError: The cell has no such arm.
    """
    for state in states.arms:
        if state.arm == arm:
            return state
    raise KeyError(f"no arm {arm!r} in {[s.arm for s in states.arms]}")


def poses_known(states: ArmStates) -> bool:
    """Return whether every arm reports its grip pose; a device does after its first feedback."""
    return bool(states.arms) and all(
        len(s.position) == 3 and len(s.orientation) == 4 for s in states.arms
    )


def obstacle_message(obstacle: geometry.Obstacle) -> Obstacle:
    """Return the message of an obstacle."""
    return Obstacle(
        **{field: getattr(obstacle, field) for field in Obstacle.DESCRIPTOR.fields_by_name}
    )


def scene_obstacles(scene: Scene) -> tuple[geometry.Obstacle, ...]:
    """Return the obstacles of a scene.

    Raises:
        ValueError: A shape is unknown or a vector has the wrong length.
    """
    return tuple(_obstacle(message) for message in scene.obstacles)


def _obstacle(message: Obstacle) -> geometry.Obstacle:
    if message.shape not in SHAPES:
        raise ValueError(
            f"obstacle {message.name!r} has shape {message.shape!r}; use one of {', '.join(SHAPES)}"
        )
    lengths = {"position": 3, "orientation": 4, "size": 3, "normal": 3}
    values = {}
    for field, count in lengths.items():
        value = tuple(getattr(message, field))
        if value and len(value) != count:
            raise ValueError(
                f"obstacle {message.name!r} has {field}={value}; it takes {count} numbers"
            )
        if value:
            values[field] = value
    if "position" not in values:
        raise ValueError(f"obstacle {message.name!r} has no position; it takes 3 numbers [m]")
    return geometry.Obstacle(
        shape=message.shape,
        radius=message.radius,
        height=message.height,
        support=message.support,
        friction=message.friction,
        name=message.name,
        **values,
    )


def motion_message(motion: obstacle_motion.ObstacleMotion, stamp: int) -> ObstacleMotion:
    """Return the message of an obstacle's motion at a time.

    Args:
        motion: Motion in the clock of the stamps.
        stamp: Time of position and velocity [ns].
    """
    now = stamp * NANOSECONDS
    return ObstacleMotion(
        name=motion.name,
        position=motion.position(now),
        velocity=motion.velocity(now),
        times=[round(t / NANOSECONDS) for t in motion.times],
        waypoints=[x for place in motion.positions for x in place],
    )


def obstacle_motions(message: SceneMotion) -> tuple[obstacle_motion.ObstacleMotion, ...]:
    """Return the motions of a scene's obstacles, in the clock of the stamps.

    Raises:
        ValueError: A motion has no waypoint, jumps, or its times do not increase.
    """
    return tuple(
        obstacle_motion.ObstacleMotion(
            motion.name,
            tuple(t * NANOSECONDS for t in motion.times),
            tuple((x, y, z) for x, y, z in chain(motion.waypoints).tolist()),
        )
        for motion in message.motions
    )


def timestamp(stamp: int) -> Timestamp:
    """Return the protobuf `Timestamp` of a stamp [ns], for Foxglove's schemas."""
    return Timestamp(seconds=stamp // 1_000_000_000, nanos=stamp % 1_000_000_000)


def from_timestamp(value: Timestamp) -> int:
    """Return the stamp of a protobuf `Timestamp` [ns]."""
    return value.seconds * 1_000_000_000 + value.nanos


def stamp_of(message: Any) -> int:
    """Return the time that a message describes [ns]; 0 if it has no stamp."""
    if hasattr(message, "stamp"):
        return message.stamp
    if hasattr(message, "timestamp"):
        return from_timestamp(message.timestamp)
    return 0
