"""Motion of a recorded run, to be looked at at any time."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from lariat.geometry import polylines, poses
from lariat.geometry.obstacle_motion import obstacles_at
from lariat.geometry.obstacles import Obstacle
from lariat.scenario import SIDES, Scenario, Side
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import IDLE, chain, goal_of, obstacle_motions, scene_obstacles, stamp_of
from shared.recording import Recording
from shared.video.arm_bodies import arm_bodies

STEM_RADIUS = 0.008
"""Radius of what joins an arm to its gripper [m]."""


@dataclass(frozen=True)
class Instant:
    """Cell at one time of a run."""

    nodes: Float64[np.ndarray, "n 3"]
    """Nodes of the rope [m]."""
    grips: tuple[Float64[np.ndarray, "2 3"], ...]
    """Ends of the axis of each gripper's body [m]."""
    goal: Float64[np.ndarray, "m 3"]
    """Nodes of the goal [m]."""
    path: Float64[np.ndarray, "2 p 3"]
    """Planned positions of both grips [m]."""
    obstacles: tuple[Obstacle, ...]
    """Obstacles."""
    arms: tuple[Obstacle, ...]
    """Bodies of the arms."""
    error: float
    """Mean node distance of rope and goal [m]."""
    others: tuple[Float64[np.ndarray, "k 3"], ...] = ()
    """Axes of other ropes, as perceived [m]."""
    view: UInt8[np.ndarray, "h w 3"] | None = None
    """Image of the first camera, blue first; None where none was recorded."""


class RecordedRun:
    """Run of a recording, from its start to the recording's end."""

    def __init__(self, recording: Recording) -> None:
        with tempfile.TemporaryDirectory() as folder:
            self.scenario: Scenario = recording.scenario(Path(folder))
            """Scenario that ran."""
            self._arms = {side: arm_bodies(self.scenario, side) for side in SIDES}
        self._camera = topics.CAMERA_COLOR.at(self.scenario.camera_setups[0].name).key
        kept = (
            topics.ROPE_TRUTH.key,
            topics.ROPE_NODES.key,
            topics.ROPE_OTHERS.key,
            topics.TASK_STATE.key,
            topics.ARM_STATE.key,
            topics.SCENE_STATE.key,
            topics.SCENE_MOTION.key,
            topics.CONTROLLER_PATH.key,
            self._camera,
        )
        self._series: dict[str, tuple[list[float], list[Any]]] = {}
        begin = 0
        for entry, message in recording.decoded(kept):
            if entry.key == topics.TASK_STATE.key and message.state != IDLE and not begin:
                begin = message.run_started or message.stamp
            stamps, values = self._series.setdefault(entry.key, ([], []))
            stamps.append(stamp_of(message) / SECOND)
            values.append(message)
        if not begin:
            raise ValueError(f"{recording.path} holds no run")
        self._begin = begin / SECOND
        truth = topics.ROPE_TRUTH.key
        self._rope = truth if truth in self._series else topics.ROPE_NODES.key
        stamps, chains = self._series[self._rope]
        self._nodes = [chain(message.positions) for message in chains]
        self.duration = stamps[-1] - self._begin
        """Duration of the run [s]."""

    def at(self, time: float) -> Instant:
        """Return the cell at a time of the run [s]; before and after the run it stands still."""
        now = self._begin + time
        stamps = self._series[self._rope][0]
        k = int(np.clip(np.searchsorted(stamps, now) - 1, 0, max(len(stamps) - 2, 0)))
        after = min(k + 1, len(stamps) - 1)
        share = (now - stamps[k]) / max(stamps[after] - stamps[k], 1e-9)
        share = float(np.clip(share, 0.0, 1.0))
        nodes = (1.0 - share) * self._nodes[k] + share * self._nodes[after]
        task = self._latest(topics.TASK_STATE.key, now)
        goal = goal_of(task.goal)
        path = self._latest(topics.CONTROLLER_PATH.key, now)
        ways = [chain(p) for p in (path.left_positions, path.right_positions)] if path else []
        scene = self._latest(topics.SCENE_STATE.key, now)
        obstacles = scene_obstacles(scene) if scene else self.scenario.bodies
        if (motion := self._latest(topics.SCENE_MOTION.key, now)) is not None:
            obstacles = obstacles_at(obstacles, obstacle_motions(motion), now)
        grips = self._grippers(nodes, now)
        distance = polylines.resample_smooth(nodes, len(goal.nodes)) - goal.nodes
        return Instant(
            nodes,
            tuple(grips.values()),
            goal.nodes,
            np.array(ways).reshape(2, -1, 3) if ways else np.zeros((2, 0, 3)),
            tuple(o for o in obstacles if o.shape != "half_space"),
            self._arm_bodies(grips, now),
            float(np.linalg.norm(distance, axis=1)[goal.counted].mean()),
            self._others(now),
            self._view(now),
        )

    def _grippers(
        self, nodes: Float64[np.ndarray, "n 3"], now: float
    ) -> dict[Side, Float64[np.ndarray, "2 3"]]:
        """Axes of the grippers' bodies: from each end of the rope along its tangent, outwards."""
        reach = self.scenario.limits.gripper_height
        states = self._latest(topics.ARM_STATE.key, now)
        sides = {arm.arm for arm in states.arms}
        axes: dict[Side, np.ndarray] = {}
        for side, end, inner in ((SIDES[0], 0, 1), (SIDES[1], -1, -2)):
            if side in sides:
                outwards = nodes[end] - nodes[inner]
                outwards = outwards / np.linalg.norm(outwards)
                axes[side] = np.array([nodes[end], nodes[end] + reach * outwards])
        return axes

    def _arm_bodies(
        self, grips: dict[Side, Float64[np.ndarray, "2 3"]], now: float
    ) -> tuple[Obstacle, ...]:
        """Bodies of the arms, and of what joins the last one to its gripper."""
        joints = {a.arm: np.array(a.joints) for a in self._latest(topics.ARM_STATE.key, now).arms}
        bodies: list[Obstacle] = []
        for side, arm in self._arms.items():
            links = arm.at(joints[side]) if arm is not None and side in joints else ()
            bodies += links
            if links and side in grips:
                bodies.append(_stem(np.array(links[-1].position), grips[side][1]))
        return tuple(bodies)

    def _others(self, now: float) -> tuple[Float64[np.ndarray, "k 3"], ...]:
        message = self._latest(topics.ROPE_OTHERS.key, now)
        ropes = message.ropes if message is not None else ()
        return tuple(chain(line.positions) for rope in ropes for line in rope.lines)

    def _view(self, now: float) -> UInt8[np.ndarray, "h w 3"] | None:
        message = self._latest(self._camera, now)
        if message is None:
            return None
        return cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_COLOR)

    def _latest(self, key: str, now: float) -> Any:
        if key not in self._series:
            return None
        stamps, values = self._series[key]
        return values[max(int(np.searchsorted(stamps, now, side="right")) - 1, 0)]


def _stem(begin: Float64[np.ndarray, "3"], end: Float64[np.ndarray, "3"]) -> Obstacle:
    """Capsule between two points."""
    length = float(np.linalg.norm(end - begin))
    turn = poses.rotation_between(np.array([0.0, 0.0, 1.0]), (end - begin) / max(length, 1e-9))
    (x, y, z), (w, i, j, k) = (0.5 * (begin + end)).tolist(), turn.tolist()
    return Obstacle("capsule", (x, y, z), (w, i, j, k), radius=STEM_RADIUS, height=length)
