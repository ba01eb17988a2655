"""Rod that is laid along a route, in steps that follow its history without inertia."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.cable_laying import laying_waypoints, middle_clip
from lariat.geometry.cable_routes import LEGS, RouteStop, laid_chain
from lariat.geometry.obstacles import Obstacle, pack_supports
from lariat.geometry.poses import Pose
from lariat.rod.rod import Rod
from lariat.rod.rollout_spec import RolloutSpec
from lariat.rod.state import RodState

HOVER_CLEARANCE = 0.03
"""Height of the lowest point above the tips of the first clip before it is lowered [m]."""
STEPS_PER_WAYPOINT = 10
"""Number of steps between two waypoints."""
STEP_TIME = 0.1
"""Duration of a step [s], in which the swing of a cable decays."""
SETTLING_STEPS = 20
"""Number of steps without motion at the end."""

MAX_CORRECTIONS = 8
"""Largest number of corrections of the aims."""
CORRECTION = 1.5
"""Correction of an aim over what the rod misses; a rod goes less aside than its ends [-]."""
MISS_TOLERANCE = 1.5e-3
"""Distance from the middle of a clip that is not corrected [m]."""

Waypoints = tuple[Float64[np.ndarray, "w 2 3"], Float64[np.ndarray, "w 2 4"]]
"""Positions [m] and orientations of both grips."""


def laying(
    rod: Rod,
    stops: Sequence[RouteStop],
    grips: tuple[Pose, Pose],
    rotates: tuple[bool, bool],
    obstacles: Sequence[Obstacle],
) -> tuple[RodState, Waypoints]:
    """Return a rod that hangs over a route, and the waypoints of its grips that lay it from there.

    A bending rod does not come to lie where its ends point: the ends aim beside the clips by as
    much as it misses them where they have no legs.

    Args:
        rod: The rod.
        stops: Stops of the route.
        grips: Poses of the ends at the goal.
        rotates: Whether each end rotates.
        obstacles: Obstacles, of which the supports count.

    Raises:
        ValueError: The rod is too short for the route.
    """
    length = rod.properties.length
    ends = np.array([grip.position for grip in grips])
    _, places = laid_chain(stops, ends, length, rod.node_count)
    first = middle_clip(stops, places, length)
    clips = [(k, stop.clip) for k, stop in enumerate(stops) if stop.clip and k != first]
    legs = {clip.name + leg for _, clip in clips for leg in LEGS}
    open_board = pack_supports([o for o in obstacles if o.name not in legs])
    aims = np.zeros((len(stops), 3))
    state, waypoints = _from_above(rod, stops, places, grips, rotates, aims)
    for _ in range(MAX_CORRECTIONS):
        nodes = laid(rod, state, waypoints, open_board).positions
        misses = np.zeros_like(aims)
        for k, clip in clips:
            lefts = clip.crossings(nodes)[:, 0]
            misses[k] = clip.left * min(lefts, key=abs, default=0.0)
        if np.max(np.linalg.norm(misses, axis=1)) < MISS_TOLERANCE:
            break
        aims -= CORRECTION * misses
        state, waypoints = _from_above(rod, stops, places, grips, rotates, aims)
    return state, waypoints


def _from_above(
    rod: Rod,
    stops: Sequence[RouteStop],
    places: Float64[np.ndarray, "k"],
    grips: tuple[Pose, Pose],
    rotates: tuple[bool, bool],
    aims: Float64[np.ndarray, "k 3"],
) -> tuple[RodState, Waypoints]:
    """Rod that hangs over the first clip, and waypoints from there."""
    length = rod.properties.length
    positions, orientations = laying_waypoints(stops, places, grips, length, rotates, aims)
    first = stops[middle_clip(stops, places, length)].clip
    assert first is not None
    start = (
        Pose(position, turn) for position, turn in zip(positions[0], orientations[0], strict=True)
    )
    hanging = rod.rest(*start).state
    needed = first.foot[2] + first.height + rod.properties.diameter + HOVER_CLEARANCE
    lift = np.array([0.0, 0.0, needed - np.min(hanging.positions[:, 2])])
    state = replace(hanging, positions=hanging.positions + lift)
    down = np.concatenate([(positions[0] + lift)[None], positions])
    return state, (down, np.concatenate([orientations[:1], orientations]))


def laid(
    rod: Rod, state: RodState, waypoints: Waypoints, obstacles: Float64[np.ndarray, "m 13"] | None
) -> RodState:
    """Return the rod at rest after its grips have gone along waypoints.

    Args:
        rod: The rod.
        state: Rod at the first waypoint.
        waypoints: Waypoints.
        obstacles: Supports, packed.
    """
    positions, orientations = waypoints
    turns = poses.multiply(orientations[1:], poses.conjugate(orientations[:-1]))
    moves = np.concatenate([np.diff(positions, axis=0), poses.logarithm(turns)], axis=2)
    duration = STEPS_PER_WAYPOINT * STEP_TIME
    actions = np.concatenate([moves / duration, np.zeros((1, 2, 6))])
    blocks = np.repeat(np.arange(len(moves)), STEPS_PER_WAYPOINT)
    blocks = np.concatenate([blocks, np.full(SETTLING_STEPS, len(moves))])
    spec = RolloutSpec(state, actions, STEP_TIME, block_of_step=blocks, obstacles=obstacles)
    return rod.rollout(spec).final.at_rest()
