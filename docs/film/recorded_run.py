"""Motion of a recorded run, to be looked at at any time."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.geometry.obstacles import Obstacle
from shared import topics
from shared.messages import IDLE, chain, scene_obstacles
from shared.recording import Recording
from shared.scenario import SIDES, Scenario
from shared.service import SECOND


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
    error: float
    """Mean node distance of rope and goal [m]."""


class RecordedRun:
    """Run of a recording, from its start to the recording's end."""

    def __init__(self, file: Path) -> None:
        """Read the recording.

        Args:
            file: Recording.

        Raises:
            ValueError: It cannot be read, or holds no run.
        """
        recording = Recording.open(file)
        with tempfile.TemporaryDirectory() as folder:
            self.scenario: Scenario = recording.scenario(Path(folder))
        """Scenario that ran."""
        nodes = topics.ROPE_TRUTH, topics.ROPE_NODES
        kept = (
            *nodes,
            topics.TASK_STATE,
            topics.ARM_STATE,
            topics.SCENE_STATE,
            topics.CONTROLLER_PATH,
        )
        self._series: dict[str, tuple[list[float], list[Any]]] = {}
        begin = 0
        for entry in recording.messages({topic.key for topic in kept}):
            message = entry.parse()
            if entry.key == topics.TASK_STATE.key and message.state != IDLE and not begin:
                begin = message.run_started or message.stamp
            stamps, values = self._series.setdefault(entry.key, ([], []))
            stamps.append(message.stamp / SECOND)
            values.append(message)
        if not begin:
            raise ValueError(f"{file} holds no run")
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
        goal = chain(task.goal.positions)
        path = self._latest(topics.CONTROLLER_PATH.key, now)
        ways = [chain(p) for p in (path.left_positions, path.right_positions)] if path else []
        scene = self._latest(topics.SCENE_STATE.key, now)
        obstacles = scene_obstacles(scene) if scene else self.scenario.bodies
        distance = polylines.resample_smooth(nodes, len(goal)) - goal
        return Instant(
            nodes,
            self._grippers(nodes, now),
            goal,
            np.array(ways).reshape(2, -1, 3) if ways else np.zeros((2, 0, 3)),
            tuple(o for o in obstacles if o.shape != "half_space"),
            float(np.linalg.norm(distance, axis=1).mean()),
        )

    def _grippers(
        self, nodes: Float64[np.ndarray, "n 3"], now: float
    ) -> tuple[Float64[np.ndarray, "2 3"], ...]:
        """Axes of the grippers' bodies: from each end of the rope along its tangent, outwards."""
        reach = self.scenario.limits.gripper_height
        states = self._latest(topics.ARM_STATE.key, now)
        held = {arm.arm for arm in states.arms}
        axes = []
        for side, end, inner in ((SIDES[0], 0, 1), (SIDES[1], -1, -2)):
            if side in held:
                outwards = nodes[end] - nodes[inner]
                outwards = outwards / np.linalg.norm(outwards)
                axes.append(np.array([nodes[end], nodes[end] + reach * outwards]))
        return tuple(axes)

    def _latest(self, key: str, now: float) -> Any:
        if key not in self._series:
            return None
        stamps, values = self._series[key]
        return values[max(int(np.searchsorted(stamps, now, side="right")) - 1, 0)]
