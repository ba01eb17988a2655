"""Departure of a path among obstacles that move along known paths.

A path is found among the obstacles that stand still. Then the earliest departure is sought at which
the rope and the grippers keep clear of the moving ones: before it, on the way, and at the goal.
Where that takes a wait, a path clear of everything that the moving obstacles sweep is found as
well, and the one that arrives first is taken.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry.obstacle_motion import ObstacleMotion, obstacles_at
from lariat.geometry.obstacles import Obstacle, signed_distance
from lariat.geometry.polylines import with_midpoints
from lariat.planning.problem import Problem, WholePath
from lariat.planning.shorter_path import stay

FindPath = Callable[[Problem], WholePath]
"""Planner among obstacles that stand still."""


COMPARISON_PERIOD = 0.04
"""Time between two compared instants [s]."""
DEPARTURE_WINDOW = 0.4
"""Time for which a departure stays possible [s]."""
FORESIGHT = 0.25
"""Time by which the controller keeps clear of an obstacle in advance [s]."""
LONGEST_WAIT = 30.0
"""Longest wait before a departure [s]."""
TOLERATED_WAIT = 2.0
"""Wait up to which no path round the swept places is sought [s]."""
LONGEST_PATH = 30.0
"""Time after the longest wait over which motions are compared [s]."""
SWEEP_STEP = 0.05
"""Distance between two places of a swept obstacle [m]."""
MOST_PLACES = 24
"""Largest number of places of a swept obstacle."""


@dataclass(frozen=True)
class MovingObstacle:
    """Obstacle with its known motion."""

    body: Obstacle
    """The obstacle, anywhere."""
    motion: ObstacleMotion
    """Its motion."""


@dataclass(frozen=True)
class Departure:
    """Path, and the time at which it has to begin."""

    path: WholePath
    """Path."""
    after: float
    """Time from which on it may begin [s]."""
    before: float
    """Time until which it has to begin [s]."""

    @property
    def arrival(self) -> float:
        """Earliest time at which the end of the path is reached [s]."""
        return self.after + len(self.path.positions) * self.path.dt


def divided(
    obstacles: Sequence[Obstacle], motions: Sequence[ObstacleMotion], time: float
) -> tuple[tuple[Obstacle, ...], tuple[MovingObstacle, ...]]:
    """Return the obstacles that stand still from a time on [s], and those that move."""
    ahead = {motion.name: motion for motion in motions if motion.end > time}
    still = tuple(o for o in obstacles if o.name not in ahead)
    moving = tuple(MovingObstacle(o, ahead[o.name]) for o in obstacles if o.name in ahead)
    return obstacles_at(still, motions, time), moving


def plan_departure(
    problem: Problem,
    moving: Sequence[MovingObstacle],
    earliest: float,
    find: FindPath,
) -> Departure:
    """Return the path that arrives first without meeting a moving obstacle.

    It departs at `earliest` or later [s], in the clock of the motions.
    """
    direct = find(problem)
    departures = [d for d in [departure(problem, direct, moving, earliest)] if d is not None]
    patience = earliest + TOLERATED_WAIT
    if direct.reached and (not departures or departures[0].after > patience):
        swept = [o for body in moving for o in swept_places(body, earliest)]
        around = find(replace(problem, obstacles=(*problem.obstacles, *swept)))
        detour = departure(problem, around, moving, earliest) if around.reached else None
        departures += [detour] if detour is not None else []
    if departures:
        return min(departures, key=lambda d: d.arrival)
    names = ", ".join(repr(m.body.name) for m in moving)
    reason = (
        f"blocked: no departure within {LONGEST_WAIT:g} s keeps clear of {names}, which "
        "move; move start or goal out of their way"
    )
    return Departure(stay(problem, reason), earliest, earliest + DEPARTURE_WINDOW)


def departure(
    problem: Problem,
    path: WholePath,
    moving: Sequence[MovingObstacle],
    earliest: float,
) -> Departure | None:
    """Return the departure on a path, `earliest` or later [s]; None if there is none in time."""
    stride = max(round(COMPARISON_PERIOD / path.dt), 1)
    period = stride * path.dt
    last = max(m.motion.end for m in moving)
    longest = LONGEST_WAIT + LONGEST_PATH
    duration = min(max(last - earliest, 0.0), longest) + DEPARTURE_WINDOW + FORESIGHT
    instants = earliest + period * np.arange(int(duration / period) + 2)
    clear = np.ones((len(path.nodes[::stride]) + 1, len(instants)), dtype=bool)
    for each in moving:
        clear &= _clear(problem, path, each, instants, stride)
    slack = int(np.ceil((DEPARTURE_WINDOW + FORESIGHT) / period))
    waits = int(LONGEST_WAIT / period)
    for wait in range(min(waits, len(instants) - 1) + 1):
        if not clear[0, : wait + slack + 1].all():
            return None  # The rope has to be gone by then.
        if _passes(clear, wait, slack):
            after = float(earliest + wait * period)
            return Departure(path, after, after + DEPARTURE_WINDOW)
    return None


def _passes(clear: Bool[np.ndarray, "k t"], wait: int, slack: int) -> bool:
    """Whether a path is clear that begins up to `slack` instants after a wait."""
    count, last = clear.shape[0], clear.shape[1] - 1
    shapes = np.arange(count)
    for late in range(slack + 1):
        at = np.minimum(wait + late + shapes, last)
        if not (clear[shapes, at].all() and clear[-1, at[-1] :].all()):
            return False
    return True


def _clear(
    problem: Problem,
    path: WholePath,
    moving: MovingObstacle,
    instants: Float64[np.ndarray, "t"],
    stride: int,
) -> Bool[np.ndarray, "k t"]:
    """Whether each shape of a path, the last one at its end, keeps clear at each instant."""
    limits = problem.limits
    chosen = np.append(np.arange(0, len(path.nodes), stride), len(path.nodes) - 1)
    nodes = with_midpoints(path.nodes[chosen])
    bodies = problem.gripper_points(path[chosen])
    places = np.array([moving.motion.position(t) for t in instants])
    # Half of what rope and obstacle move between two instants.
    steps = np.linalg.norm(np.diff(path.nodes[chosen], axis=0), axis=2).max(axis=1, initial=0.0)
    gone = np.linalg.norm(np.diff(places, axis=0), axis=1)
    own = 0.5 * np.maximum(np.append(steps, 0.0), np.insert(steps, 0, 0.0))
    reserve = own[:, None] + 0.5 * np.maximum(np.append(gone, 0.0), np.insert(gone, 0, 0.0))
    rope_needs = problem.clearance + problem.radius
    body_needs = limits.gripper_radius + max(limits.keep_out, problem.clearance)
    clear = np.empty((len(chosen), len(instants)), dtype=bool)
    slacks: dict[tuple[float, ...], Float64[np.ndarray, "k"]] = {}
    for k, place in enumerate(places):
        key = tuple(place.tolist())
        if key not in slacks:
            body = moving.body.moved((key[0], key[1], key[2]))
            rope = signed_distance(nodes, body).min(axis=1) - rope_needs
            slacks[key] = np.minimum(rope, signed_distance(bodies, body).min(axis=1) - body_needs)
        clear[:, k] = slacks[key] >= reserve[:, k]
    return clear


def swept_places(moving: MovingObstacle, earliest: float) -> tuple[Obstacle, ...]:
    """Return an obstacle at the places that it passes from a time on [s]."""
    motion = moving.motion
    corners = [motion.position(earliest)]
    corners += [p for t, p in zip(motion.times, motion.positions, strict=True) if t > earliest]
    points = np.array(corners)
    way = np.insert(np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)), 0, 0.0)
    count = min(int(np.ceil(way[-1] / SWEEP_STEP)) + 1, MOST_PLACES)
    at = np.linspace(0.0, way[-1], count)
    places = np.stack([np.interp(at, way, column) for column in points.T], axis=1)
    return tuple(moving.body.moved((x, y, z)) for x, y, z in dict.fromkeys(map(tuple, places)))
