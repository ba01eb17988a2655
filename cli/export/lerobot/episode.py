"""Frames of a recorded run, at the rate of a data set."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float32

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.scenario.cameras import DEFAULT_CAMERA
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import RUNNING, ArmSetpoints, ArmStates, Setpoints
from shared.recording import Recording

FRAME_RATE = 20
"""Rate of the frames [Hz]."""
STATE, NODES, GOAL = "observation.state", "observation.environment_state", "observation.goal"
ACTION, IMAGE = "action", f"observation.images.{DEFAULT_CAMERA}"
Frame = dict[str, Any]
"""Values of one instant by the name of their feature; images are encoded."""


@dataclass
class Episode:
    """Frames of one run."""

    task: str
    """Task in words."""
    arms: tuple[str, ...] = ()
    """Names of the arms, in the order of the features."""
    frames: list[Frame] = field(default_factory=list)
    """Frames, `1 / FRAME_RATE` apart."""


def read_episode(recording: Recording) -> Episode:
    """Return the frames of a recording while its task runs."""
    color = topics.CAMERA_COLOR.at(DEFAULT_CAMERA).key
    keys = {t.key for t in (topics.TASK_STATE, topics.ROPE_NODES, topics.ARM_STATE)}
    latest: dict[str, Any] = {}
    episode = Episode(f"Shape the rope of {recording.metadata.get('scenario', 'a recording')}")
    begin = 0
    for entry, message in recording.decoded({*keys, topics.ARM_SETPOINTS.key, color}):
        latest[entry.key] = message
        if entry.key != topics.ARM_STATE.key or not keys <= latest.keys():
            continue
        task, rope = latest[topics.TASK_STATE.key], latest[topics.ROPE_NODES.key]
        if task.state != RUNNING or not task.goal.positions or not rope.positions:
            continue
        if not episode.frames:
            begin = message.stamp
            episode.arms = tuple(sorted(arm.arm for arm in message.arms))
        if message.stamp < begin + len(episode.frames) * SECOND // FRAME_RATE:
            continue
        frame = {
            STATE: _poses(message, episode.arms),
            NODES: np.array(rope.positions, np.float32),
            GOAL: np.array(task.goal.positions, np.float32),
            ACTION: _commanded(latest.get(topics.ARM_SETPOINTS.key), message, episode.arms),
        }
        if color in latest:
            frame[IMAGE] = latest[color].data
        episode.frames.append(frame)
    # Images that begin within the run would leave frames without one.
    with_image = [IMAGE in frame for frame in episode.frames]
    if any(with_image):
        episode.frames = episode.frames[with_image.index(True) :]
    return episode


def _poses(states: ArmStates, arms: Iterable[str]) -> Float32[np.ndarray, "p"]:
    """Poses of the arms, one after the other."""
    pose_of = {arm.arm: [*arm.position, *arm.orientation] for arm in states.arms}
    return np.concatenate([pose_of[arm] for arm in arms]).astype(np.float32)


def _commanded(
    setpoints: Setpoints | None, states: ArmStates, arms: Iterable[str]
) -> Float32[np.ndarray, "p"]:
    """Poses that are commanded for the next frame; the measured ones where nothing is commanded."""
    measured = {arm.arm: [*arm.position, *arm.orientation] for arm in states.arms}
    pose_of = {**measured}
    if setpoints is not None and not setpoints.hold:
        time = (states.stamp + SECOND // FRAME_RATE - setpoints.t0) / setpoints.dt
        for chunk in setpoints.arms:
            pose = _interpolated(chunk, time)
            pose_of[chunk.arm] = [*pose.position, *pose.orientation]
    return np.concatenate([pose_of[arm] for arm in arms]).astype(np.float32)


def _interpolated(chunk: ArmSetpoints, time: float) -> Pose:
    """Pose of a chunk at a time in units of its period; the last one holds."""
    positions = np.reshape(chunk.positions, (-1, 3))
    orientations = np.reshape(chunk.orientations, (-1, 4))
    time = min(max(time, 0.0), len(positions) - 1.0)
    k = min(int(time), max(len(positions) - 2, 0))
    following = min(k + 1, len(positions) - 1)
    return poses.interpolate(
        Pose(positions[k], orientations[k]),
        Pose(positions[following], orientations[following]),
        time - k,
    )
