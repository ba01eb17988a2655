"""True poses of the obstacles that carry markers.

Perception must find marked obstacles, which may stand elsewhere than the scenario says; events and
people move them. Obstacles without a marker stand where `scene/state` says.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from lariat.geometry import poses
from lariat.geometry.markers import marker_pose
from lariat.geometry.obstacles import Obstacle
from lariat.reset_counter import ResetCounter
from lariat.scenario import Scenario
from lariat.simulation.camera.marker_plates import MarkerPlate
from shared.messages import Scene, SceneRequest, TaskState


class MarkedObstacles:
    """Marked obstacles of a scenario at their true poses."""

    def __init__(self, scenario: Scenario) -> None:
        self._marked = scenario.marked_obstacles
        self._events = [e for e in scenario.events if e.move_obstacle in self._marked]
        bodies = {o.name: o for o in scenario.bodies}
        self._start = {}
        for name, marked in self._marked.items():
            turn = np.array([0.0, 0.0, math.radians(marked.stands_turned)])
            orientation = poses.multiply(
                poses.exponential(turn), np.array(bodies[name].orientation)
            )
            self._start[name] = bodies[name].moved(
                marked.stands_at or marked.position, tuple(orientation.tolist())
            )
        self._present = dict(self._start)
        self._pending: dict[str, SceneRequest] = {}
        self._event_count = 0
        self._resets = ResetCounter()
        self._run_started = 0
        self.revision = 0
        """Number of changes."""

    def update_task(self, task: TaskState, now: int) -> None:
        """Carry out the events that are due at `now` [ns], and a reset."""
        if self._resets.advanced(task.reset_count):
            self._present = dict(self._start)
            self.revision += 1
        if task.run_started != self._run_started:
            self._run_started, self._event_count = task.run_started, 0
        if not self._run_started:
            return
        elapsed = (now - self._run_started) / 1e9
        due = sorted((e for e in self._events if e.time <= elapsed), key=lambda e: e.time)
        for event in due[self._event_count :]:
            assert event.position is not None
            self._move(event.move_obstacle, event.position)
        self._event_count = len(due)

    def take_request(self, request: SceneRequest) -> None:
        """Keep a request to move an obstacle until perception has answered it."""
        body = request.obstacle
        if request.action == SceneRequest.MOVE and body.name in self._present:
            self._pending = {request.id: request}

    def take_scene(self, scene: Scene) -> None:
        """Move an obstacle if perception has accepted the request."""
        request = self._pending.pop(scene.last_request, None)
        if request is not None and not scene.refusal:
            body = request.obstacle
            self._move(body.name, tuple(body.position), tuple(body.orientation))

    def merged(self, believed: Sequence[Obstacle]) -> tuple[Obstacle, ...]:
        """Return believed obstacles, the marked ones among them at their true poses."""
        return tuple(self._present.get(o.name, o) for o in believed)

    def plates(self, obstacles: Sequence[Obstacle]) -> list[MarkerPlate]:
        """Marker plates on those of some obstacles that carry one."""
        return [
            MarkerPlate(
                marker_pose(o), self._marked[o.name].marker_size, self._marked[o.name].marker
            )
            for o in obstacles
            if o.name in self._marked
        ]

    def _move(
        self, name: str, position: tuple[float, ...], orientation: tuple[float, ...] = ()
    ) -> None:
        old = self._present[name]
        self._present[name] = old.moved(position, orientation or old.orientation)
        self.revision += 1
