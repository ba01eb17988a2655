"""Scenario that goes on from a moment of a recording.

Rope, grips, goal and obstacles are those of the moment. The rope begins at rest, and what the
controller had learnt is not carried over: estimates start as the scenario gives them.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64

from lariat.configuration import ConfigurationError
from lariat.geometry import polylines
from lariat.geometry.obstacle_motion import obstacles_at
from lariat.scenario import SIDES, Scenario
from lariat.scenario.entries import inline, numbers, obstacle_entry
from lariat.scenario.settings import with_settings
from lariat.trajectory import NANOSECONDS, SECOND
from shared import topics
from shared.messages import (
    SceneMotion,
    arm_pose,
    chain,
    goal_of,
    obstacle_motions,
    scene_obstacles,
)
from shared.recording import Recording

STATES = (
    topics.ROPE_TRUTH,
    topics.ROPE_NODES,
    topics.ARM_STATE,
    topics.TASK_STATE,
    topics.SCENE_STATE,
    topics.SCENE_MOTION,
)
"""Topics that describe a moment."""


def scenario_at(recording: Recording, folder: Path, seconds: float) -> Scenario:
    """Return the scenario that begins as a recording was at a moment."""
    scenario = recording.scenario(folder)
    newest, first, last = _newest(recording, seconds)
    if not 0.0 <= seconds <= (last - first) / SECOND:
        raise ConfigurationError(
            f"--from {seconds:g}: the recording lasts {(last - first) / SECOND:.2f} s"
        )
    rope = newest.get(topics.ROPE_TRUTH.key) or newest.get(topics.ROPE_NODES.key)
    arms, task = newest.get(topics.ARM_STATE.key), newest.get(topics.TASK_STATE.key)
    if rope is None or not rope.positions or arms is None or task is None:
        raise ConfigurationError(
            f"--from {seconds:g}: rope, arms or task were not known yet; choose a later moment"
        )
    goal = goal_of(task.goal)
    counted, nodes = goal.counted, goal.nodes[goal.counted]
    if goal.part is not None:
        begin, end = polylines.arc_lengths(goal.nodes)[counted][[0, -1]].tolist()
        goal = replace(goal, part=(begin, end))
    rows = _rows(chain(rope.positions))
    start: dict[str, Any] = {"nodes": rows, "turns": float(round(task.turns))}
    for side in SIDES:
        start[f"{side}_orientation"] = numbers(arm_pose(arms, side).orientation)
    settings = [
        f"start={inline(start)}",
        f"goal={inline(goal.entry(SIDES, _rows(nodes)))}",
        "events=[]",
    ]
    scene = newest.get(topics.SCENE_STATE.key)
    if scene is not None:
        table = {b.name for b in scenario.bodies} - {
            o.body(k).name for k, o in enumerate(scenario.obstacles)
        }
        motion = newest.get(topics.SCENE_MOTION.key) or SceneMotion()
        # Moving obstacles stand still where they were.
        present = obstacles_at(
            scene_obstacles(scene), obstacle_motions(motion), motion.stamp * NANOSECONDS
        )
        bodies = [obstacle_entry(b) for b in present if b.name not in table]
        settings.append(f"obstacles={inline(bodies)}")
    return with_settings(scenario, settings)


def _rows(nodes: Float64[np.ndarray, "n 3"]) -> list[list[float]]:
    return [numbers(node) for node in nodes]


def _newest(recording: Recording, seconds: float) -> tuple[dict[str, Any], int, int]:
    """Return the newest states at a moment by key, and first and last time of the file [ns]."""
    keys = {topic.key for topic in STATES}
    newest: dict[str, Any] = {}
    first = last = 0
    for entry in recording.messages():
        first, last = first or entry.log_time, entry.log_time
        if entry.key in keys and entry.log_time <= first + seconds * SECOND:
            newest[entry.key] = entry
    return {key: entry.parse() for key, entry in newest.items()}, first, last
