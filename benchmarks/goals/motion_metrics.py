"""Metrics of the arms' motion: speed, acceleration, grip distance, gripper clearance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry.grippers import gripper_points
from lariat.geometry.obstacle_motion import ObstacleMotion, obstacles_at
from lariat.geometry.obstacles import Obstacle, segment_distance
from lariat.geometry.poses import Pose
from lariat.scenario import Scenario
from lariat.scenario.sections import Limits
from lariat.trajectory import NANOSECONDS, SECOND
from shared import topics
from shared.messages import (
    ArmStates,
    TaskState,
    arm_pose,
    obstacle_motions,
    poses_known,
    scene_obstacles,
)
from stack.simulation.simulated_time import Delivery

CLEARANCE_PERIOD = SECOND // 30
"""Time between two measurements of the grippers' clearance [ns]."""
REST_SPEED = 0.005
"""Speed of the faster grip below which the arms stand still [m/s]."""


class MotionMetrics:
    """Tap that measures the motion of the grips, relative to its limits."""

    def __init__(self, scenario: Scenario) -> None:
        self.speed = self.acceleration = 0.0
        """Largest linear or angular speed and acceleration, relative to their limits [-]."""
        self.grip_distance = 0.0
        """Largest distance of the grips, relative to the rope's length [-]."""
        self.gripper_clearance = np.inf
        """Least distance of a gripper's body from an obstacle that is not a support [m]."""
        self.longest_stop = 0.0
        """Longest time for which the arms stood still on the way [s], e.g. during a plan."""
        self.task: TaskState | None = None
        """Newest state of the controller."""
        self._limits, self._length = scenario.limits, scenario.rope.length
        self._obstacles: tuple[Obstacle, ...] = scenario.bodies
        self._motions: tuple[ObstacleMotion, ...] = ()
        self._last_velocity: tuple[int, Float64[np.ndarray, "2 2 3"]] | None = None
        self._clearance_stamp = self._last_moved = 0

    def __call__(self, delivery: Delivery) -> None:
        """Take one message."""
        match delivery.key:
            case topics.ARM_STATE.key:
                self._take_arms(delivery.parse())
            case topics.SCENE_STATE.key:
                self._obstacles = scene_obstacles(delivery.parse())
            case topics.SCENE_MOTION.key:
                self._motions = obstacle_motions(delivery.parse())
            case topics.TASK_STATE.key:
                self.task = delivery.parse()

    def _take_arms(self, arms: ArmStates) -> None:
        if not poses_known(arms):
            return
        velocity = np.zeros((2, 2, 3))
        for row, arm in zip(velocity, arms.arms, strict=False):
            if arm.linear_velocity:
                row[0], row[1] = arm.linear_velocity, arm.angular_velocity
        limits = self._limits
        rates = np.linalg.norm(velocity, axis=2) / (limits.speed, limits.angular_speed)
        self.speed = max(self.speed, float(np.max(rates)))
        if np.max(np.linalg.norm(velocity[:, 0], axis=1)) > REST_SPEED:
            if self._last_moved:
                stop = (arms.stamp - self._last_moved) / SECOND
                self.longest_stop = max(self.longest_stop, stop)
            self._last_moved = arms.stamp
        if self._last_velocity is not None and arms.stamp > self._last_velocity[0]:
            dt = (arms.stamp - self._last_velocity[0]) / SECOND
            change = np.linalg.norm(velocity - self._last_velocity[1], axis=2) / dt
            shares = change / (limits.acceleration, limits.angular_acceleration)
            self.acceleration = max(self.acceleration, float(np.max(shares)))
        self._last_velocity = arms.stamp, velocity
        left, right = arm_pose(arms, "left"), arm_pose(arms, "right")
        distance = float(np.linalg.norm(right.position - left.position)) / self._length
        self.grip_distance = max(self.grip_distance, distance)
        if arms.stamp - self._clearance_stamp >= CLEARANCE_PERIOD:
            self._clearance_stamp = arms.stamp
            present = obstacles_at(self._obstacles, self._motions, arms.stamp * NANOSECONDS)
            avoid = [o for o in present if not o.support]
            clearance = gripper_clearance(left, right, avoid, limits)
            self.gripper_clearance = min(self.gripper_clearance, clearance)


def gripper_clearance(
    left: Pose, right: Pose, obstacles: Sequence[Obstacle], limits: Limits
) -> float:
    """Least distance between the gripper's capsules and any obstacle [m]."""
    points = gripper_points(left, right, limits.gripper_reach)
    distances = [segment_distance(points[::3], points[2::3], o) for o in obstacles]
    return float(np.min(distances, initial=np.inf)) - limits.gripper_radius
