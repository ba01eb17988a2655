"""Admission of scenes: a scene is taken whole or refused, and never loses the scenario's bodies."""

from __future__ import annotations

from collections.abc import Sequence

from lariat.geometry.obstacle_checks import MAX_OBSTACLES, check_obstacle
from lariat.geometry.obstacle_motion import ObstacleMotion
from lariat.geometry.obstacles import Obstacle


class SceneGuard:
    """Guard of the obstacles that the gateway keeps away from.

    Bodies of the scenario may move, except half spaces such as the table, but they neither vanish
    nor change their shape: where a scene lacks one, it stays where it was last.
    """

    def __init__(self, bodies: Sequence[Obstacle]) -> None:
        """Create a guard.

        Args:
            bodies: Bodies of the scenario, with unique names.
        """
        self._bodies = {body.name: body for body in bodies}

    def admit(self, obstacles: Sequence[Obstacle]) -> tuple[Obstacle, ...]:
        """Return the obstacles of a valid scene, completed by the scenario's bodies.

        Args:
            obstacles: Obstacles as received.

        Raises:
            ValueError: The scene has too many obstacles, an invalid one, two of one name, or one
                that changes a body of the scenario.
        """
        if len(obstacles) > MAX_OBSTACLES:
            raise ValueError(f"{len(obstacles)} obstacles; the gateway takes {MAX_OBSTACLES}")
        for obstacle in obstacles:
            check_obstacle(obstacle)
            self._check_unchanged(obstacle)
        named = {obstacle.name: obstacle for obstacle in obstacles}
        if len(named) < len(obstacles):
            raise ValueError("two obstacles have the same name")
        self._bodies = {name: named.get(name, body) for name, body in self._bodies.items()}
        missing = [body for name, body in self._bodies.items() if name not in named]
        return (*obstacles, *missing)

    def admit_motions(self, motions: Sequence[ObstacleMotion]) -> tuple[ObstacleMotion, ...]:
        """Return valid motions of obstacles.

        Args:
            motions: Motions as received.

        Raises:
            ValueError: A half space of the scenario moves, or an obstacle has two motions.
        """
        names = [motion.name for motion in motions]
        if len(set(names)) < len(names):
            raise ValueError("two motions belong to the same obstacle")
        for name in names:
            body = self._bodies.get(name)
            if body is not None and body.shape == "half_space":
                raise ValueError(f"{name!r} is a half space, which does not move")
        return tuple(motions)

    def _check_unchanged(self, obstacle: Obstacle) -> None:
        body = self._bodies.get(obstacle.name)
        if body is None:
            return
        fixed = body.shape == "half_space"
        moved = body.moved(obstacle.position, obstacle.orientation)
        if obstacle != (body if fixed else moved):
            raise ValueError(f"{obstacle.name!r} is not as in the scenario, whose bodies only move")
