"""Obstacles that stand in the lab wherever they stand, whatever anyone believes.

They carry markers: perception must find them. Events and people move them; all others follow
`scene/state`, because nothing in the lab could tell where they are.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from lariat.geometry import poses
from lariat.geometry.markers import marker_on
from lariat.geometry.obstacles import Obstacle
from services.sim.camera.marker_plates import Plate
from shared.messages import Scene, SceneRequest, TaskState
from shared.scenario import Scenario


class StandingObstacles:
    """The marked obstacles of a scenario, as they truly are."""

    def __init__(self, scenario: Scenario) -> None:
        self._marked = scenario.marked
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
        self._now = dict(self._start)
        self._asked: dict[str, SceneRequest] = {}
        self._happened = 0
        self._run_started = self._reset_count = 0
        self.revision = 0
        """Grows with every change."""

    def follow(self, task: TaskState, now: int) -> None:
        """Lets events happen that are due, and a reset put everything back."""
        if task.reset_count != self._reset_count:
            self._reset_count = task.reset_count
            self._now = dict(self._start)
            self.revision += 1
        if task.run_started != self._run_started:
            self._run_started, self._happened = task.run_started, 0
        if not self._run_started:
            return
        elapsed = (now - self._run_started) / 1e9
        due = sorted((e for e in self._events if e.time <= elapsed), key=lambda e: e.time)
        for event in due[self._happened :]:
            assert event.position is not None
            self._move(event.move_obstacle, event.position)
        self._happened = len(due)

    def ask(self, request: SceneRequest) -> None:
        """Remembers what a person wants moved, until perception has answered."""
        body = request.obstacle
        if request.action == SceneRequest.MOVE and body.name in self._now:
            self._asked = {request.id: request}

    def answer(self, scene: Scene) -> None:
        """Moves what a person may move."""
        request = self._asked.pop(scene.last_request, None)
        if request is not None and not scene.refusal:
            body = request.obstacle
            self._move(body.name, tuple(body.position), tuple(body.orientation))

    def among(self, believed: Sequence[Obstacle]) -> tuple[Obstacle, ...]:
        """What surrounds the rope: believed obstacles, marked ones where they truly stand."""
        return tuple(self._now.get(o.name, o) for o in believed)

    def plates(self, bodies: Sequence[Obstacle]) -> list[Plate]:
        """The markers on obstacles."""
        return [
            Plate(marker_on(o), self._marked[o.name].marker_size, self._marked[o.name].marker)
            for o in bodies
            if o.name in self._marked
        ]

    def _move(
        self, name: str, position: tuple[float, ...], orientation: tuple[float, ...] = ()
    ) -> None:
        old = self._now[name]
        self._now[name] = old.moved(position, orientation or old.orientation)
        self.revision += 1
