"""Publisher of the obstacles that move along known paths in every run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from lariat.geometry.obstacle_motion import obstacles_at
from lariat.geometry.obstacles import Obstacle
from lariat.scenario import Scenario
from lariat.trajectory import NANOSECONDS, SECOND
from shared import topics
from shared.messages import SceneMotion, TaskState, motion_message
from shared.runtime.service import Publication

MOVING_PERIOD = SECOND // 20
"""Time between two messages while an obstacle moves [ns]."""


class SceneMotionPublisher:
    """Motions of a scenario's obstacles, from the start of each run until a reset."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._exists = bool(scenario.obstacle_motions())
        self._run_started = self._ended_run = 0
        self._published: tuple[int, int] | None = None
        """Run of the last message, and its stamp [ns]."""

    def take_task(self, task: TaskState) -> None:
        """Follow the runs."""
        self._run_started = 0 if task.run_started == self._ended_run else task.run_started

    def reset(self, task: TaskState) -> None:
        """Return the obstacles to where they stand before a run."""
        self._ended_run, self._run_started = task.run_started, 0

    def at(self, obstacles: Sequence[Obstacle], now: int) -> tuple[Obstacle, ...]:
        """Return the obstacles of a scene where they are at a time."""
        begun = self._run_started
        motions = self._scenario.obstacle_motions(begun * NANOSECONDS) if begun else ()
        return obstacles_at(obstacles, motions, now * NANOSECONDS)

    def due(self, now: int) -> Iterator[Publication]:
        """Yield the motions when they begin, often while something moves, and once a second."""
        if not self._exists:
            return
        begun = self._run_started
        motions = self._scenario.obstacle_motions(begun * NANOSECONDS) if begun else ()
        moving = any(now * NANOSECONDS < motion.end for motion in motions)
        if self._published is not None:
            run, stamp = self._published
            if run == begun and now - stamp < (MOVING_PERIOD if moving else SECOND):
                return
        self._published = begun, now
        message = SceneMotion(
            stamp=now, run_started=begun, motions=[motion_message(m, now) for m in motions]
        )
        yield Publication(topics.SCENE_MOTION, message)
