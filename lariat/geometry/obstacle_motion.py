"""Known motion of obstacles: straight lines between waypoints, at a constant speed on each.

Before its first waypoint an obstacle stands there, after its last one it stays there.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle

MAX_OBSTACLE_SPEED = 1.0
"""Largest speed of an obstacle whose motion is known, about that of a person's hand [m/s]."""
SWEEP_SPACING, MAX_PLACES = 0.03, 60
"""Largest distance between places that stand for an obstacle on its way [m], and the most places of
all obstacles together, of which each has two at least."""
MAX_WAYPOINTS = 1000
"""Largest number of waypoints of a motion."""


@dataclass(frozen=True)
class ObstacleMotion:
    """Motion of one obstacle, which keeps its orientation."""

    name: str
    """Name of the obstacle."""
    times: tuple[float, ...]
    """Time of each waypoint [s], increasing; in the same clock as the times asked for."""
    positions: tuple[tuple[float, float, float], ...]
    """Position of the obstacle at each waypoint [m]."""

    def __post_init__(self) -> None:
        """
        Raises:
            ValueError: There is no waypoint, there are too many, times do not increase, or the
                obstacle is too fast.
        """
        if len(self.times) > MAX_WAYPOINTS:
            raise ValueError(
                f"{self.name!r} has {len(self.times)} waypoints, more than {MAX_WAYPOINTS}"
            )
        if not self.times or len(self.times) != len(self.positions):
            raise ValueError(
                f"the motion of {self.name!r} has {len(self.times)} times and "
                f"{len(self.positions)} positions; give each waypoint both, and at least one"
            )
        durations = np.diff(self.times)
        if not np.all(durations > 0.0):
            raise ValueError(
                f"the times of the waypoints of {self.name!r} do not increase: {self.times}"
            )
        moves = np.linalg.norm(np.diff(np.array(self.positions), axis=0), axis=1)
        if np.any(moves > MAX_OBSTACLE_SPEED * (1.0 + 1e-9) * durations):
            speed = float(np.max(moves / durations))
            raise ValueError(
                f"{self.name!r} moves at {speed:.3g} m/s between two waypoints, faster than "
                f"{MAX_OBSTACLE_SPEED:g} m/s; give it more time"
            )

    @property
    def end(self) -> float:
        """Time from which it rests [s]."""
        return self.times[-1]

    def position(self, time: float) -> tuple[float, float, float]:
        """Return the position at a time [m]."""
        x, y, z = (np.interp(time, self.times, column) for column in zip(*self.positions))  # noqa: B905
        return float(x), float(y), float(z)

    def max_speed(self, begin: float, end: float) -> float:
        """Return the largest speed between two times [m/s]."""
        times = [begin, *(t for t in self.times if begin < t < end)]
        return max(float(np.linalg.norm(self.velocity(t))) for t in times)

    def velocity(self, time: float) -> Float64[np.ndarray, "3"]:
        """Return the velocity from a time on [m/s]."""
        k = int(np.searchsorted(self.times, time, side="right"))
        if k == 0 or k == len(self.times):
            return np.zeros(3)
        move = np.array(self.positions[k]) - np.array(self.positions[k - 1])
        return move / (self.times[k] - self.times[k - 1])


def obstacles_during(
    obstacles: Sequence[Obstacle], motions: Sequence[ObstacleMotion], begin: float, end: float
) -> tuple[Obstacle, ...]:
    """Return obstacles where they are between two times.

    Args:
        obstacles: Obstacles of a scene.
        motions: Motions of some of them; others stay.
        begin: First time [s].
        end: Last time [s]. A moving obstacle is returned at places on its way between the times, at
            most `SWEEP_SPACING` apart, unless many move.
    """
    speed = max((motion.max_speed(begin, end) for motion in motions), default=0.0)
    wanted = int(np.ceil(speed * (end - begin) / SWEEP_SPACING)) + 1
    count = min(wanted, max(2, MAX_PLACES // max(len(motions), 1)))
    return obstacles_at(obstacles, motions, *np.linspace(begin, end, count).tolist())


def obstacles_at(
    obstacles: Sequence[Obstacle], motions: Iterable[ObstacleMotion], *times: float
) -> tuple[Obstacle, ...]:
    """Return obstacles where they are at one or more times.

    Args:
        obstacles: Obstacles of a scene.
        motions: Motions of some of them; others stay.
        times: Times [s]. A moving obstacle is returned once for each different place.
    """
    moving = {motion.name: motion for motion in motions}
    if not moving:
        return tuple(obstacles)
    result: list[Obstacle] = []
    for obstacle in obstacles:
        motion = moving.get(obstacle.name)
        places = [obstacle.position] if motion is None else map(motion.position, times)
        result += [obstacle.moved(place) for place in dict.fromkeys(places)]
    return tuple(result)
