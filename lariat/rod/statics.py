"""Equilibria: a start of the right length between two grips, then steps of growing duration.

A long implicit step without inertia is a proximal descent of the energy: robust from far away
when short, Newton's method on the statics when long.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.geometry.obstacles import chain_clearance
from lariat.geometry.poses import Pose
from lariat.rod.obstacle_table import bodies
from lariat.rod.state import Rest, RodState

if TYPE_CHECKING:
    from lariat.rod.rod import Rod

DURATIONS = 0.02 * 1.7 ** np.arange(36)
"""Of the steps that let go [s]: from a viscous crawl to pure statics."""
APPROACH = 12
"""Steps over which the grips of a guess walk to where they should be."""
TRAPPED = 0.25
"""Overlap with an obstacle beyond which a shape counts as caught inside, in diameters [-]."""
SUPPORT = 11
"""Column of packed obstacles that says whether the rope may lean on one."""
SETTLED = 1e-6
"""Movement in the last step, relative to length, below which a shape counts as at rest [-]."""


def rest(
    rod: Rod,
    left: Pose,
    right: Pose,
    guess: RodState | None,
    obstacles: Float64[np.ndarray, "m 12"] | None,
) -> Rest:
    """See `Rod.rest`."""
    check_reach(rod, left, right)
    if guess is not None:
        start = guess.at_rest()
    elif "free" in (rod.left, rod.right):
        start = straight_from(rod, left, right)
    else:
        start = _clear_start(rod, left, right, obstacles)
    found = _let_go(rod, start, left, right, obstacles)
    if not found.stable or not found.converged:
        # A symmetric start can end on a saddle: a nudge shows the way down.
        found = _let_go(rod, _nudged(rod, found.state), left, right, obstacles)
    if _clearance(rod, found.state, obstacles) < -TRAPPED * rod.properties.diameter:
        # Pushed out of the nearest face, a rod can end up pulled tight inside an obstacle.
        found = replace(found, converged=False)
    return found


def _clearance(rod: Rod, state: RodState, obstacles: Float64[np.ndarray, "m 12"] | None) -> float:
    if obstacles is None:
        return np.inf
    return chain_clearance(state.positions, rod.properties.diameter / 2.0, bodies(obstacles))


def _clear_start(
    rod: Rod, left: Pose, right: Pose, obstacles: Float64[np.ndarray, "m 12"] | None
) -> RodState:
    """The curve that sags, or where that runs into an obstacle, the clearest of its kind.

    Where there are supports it hangs so far above that the rope is laid on them from there.
    """
    start = between_grips(rod, left, right)
    if obstacles is not None and np.any(obstacles[:, SUPPORT]):
        depths = start.positions @ _down(rod)
        lift = max(depths) - min(depths) + rod.properties.diameter
        raised = replace(start, positions=start.positions - lift * _down(rod))
        if _clearance(rod, raised, obstacles) > 0.0:
            return raised
    if _clearance(rod, start, obstacles) > 0.0:
        return start
    chord = poses.normalized(right.position - left.position + np.array([1e-12, 0.0, 0.0]))
    side = np.cross(chord, _down(rod))
    others = [start]
    for direction in (-_down(rod), side, -side):
        if np.linalg.norm(direction) > 1e-3:
            others.append(between_grips(rod, left, right, poses.normalized(direction)))
    return max(others, key=lambda state: _clearance(rod, state, obstacles))


def _down(rod: Rod) -> Float64[np.ndarray, "3"]:
    gravity = np.asarray(rod.gravity, float)
    return poses.normalized(gravity) if np.any(gravity) else np.array([0.0, 0.0, -1.0])


def straight_from(rod: Rod, left: Pose, right: Pose) -> RodState:
    """Straight on from the grip that holds, where the other end is free."""
    held, reach = (left, 1.0) if rod.right == "free" else (right, -1.0)
    z = np.array([0.0, 0.0, reach])
    s = rod.edge_length * np.arange(rod.node_count)[:, None]
    nodes = held.position + s * poses.rotate(held.orientation, z)
    if rod.right != "free":
        nodes = nodes[::-1]
    n = rod.node_count
    return RodState(
        nodes.copy(), np.tile(held.orientation, (n - 1, 1)), np.zeros((n, 3)), np.zeros((n - 1, 3))
    )


def between_grips(
    rod: Rod, left: Pose, right: Pose, bulging: Float64[np.ndarray, "3"] | None = None
) -> RodState:
    """A smooth curve of the rod's length that leaves both grips straight.

    It bulges along gravity, or in the direction given.
    """
    n, length = rod.node_count, rod.properties.length
    z = np.array([0.0, 0.0, 1.0])
    a, b = left.position, right.position
    t_a, t_b = poses.rotate(left.orientation, z), poses.rotate(right.orientation, z)
    s = np.linspace(0.0, 1.0, 16 * n)[:, None]
    h00, h10 = 2 * s**3 - 3 * s**2 + 1, s**3 - 2 * s**2 + s
    down = _down(rod) if bulging is None else bulging
    chord = b - a
    if np.linalg.norm(np.cross(chord, down)) < 0.05 * np.linalg.norm(chord) + 1e-9:
        # A chord along gravity leaves no room to sag: bulge sideways.
        down = poses.rotate(left.orientation, np.array([1.0, 0.0, 0.0]))

    def curve(slope: float, bulge: float) -> Float64[np.ndarray, "k 3"]:
        h01, h11 = 1.0 - h00, s**3 - s**2
        return h00 * a + h01 * b + slope * (h10 * t_a + h11 * t_b) + bulge * (s - s**2) ** 2 * down

    # Wide tangents between near grips would lay a loop, which has another link than a hanging rope.
    slope = min(length, float(np.linalg.norm(chord)))
    if polylines.length(curve(slope, 0.0)) > length:
        slope = _bisected(lambda k: polylines.length(curve(k, 0.0)) - length, 0.0, slope)
    bulge = _bisected(lambda k: polylines.length(curve(slope, k)) - length, 0.0, 40.0 * length)
    nodes = polylines.resampled(curve(slope, bulge), n)
    return framed(nodes, left.orientation, right.orientation)


def framed(
    nodes: Float64[np.ndarray, "n 3"],
    first: Float64[np.ndarray, "4"],
    last: Float64[np.ndarray, "4"],
) -> RodState:
    """Nodes with orientations along them, twist spread evenly between those of the two ends."""
    tangents = poses.normalized(np.diff(nodes, axis=0))
    z = np.array([0.0, 0.0, 1.0])
    q = poses.multiply(poses.between(poses.rotate(first, z), tangents[0]), first)
    frames = [q]
    for step in poses.between(tangents[:-1], tangents[1:]):
        q = poses.multiply(step, q)
        frames.append(q)
    end = poses.multiply(poses.between(poses.rotate(last, z), tangents[-1]), last)
    twist = poses.logarithm(poses.multiply(poses.conjugate(q), end))[2]
    angles = twist * np.linspace(0.0, 1.0, len(frames))
    spins = poses.exponential(angles[:, None] * z)
    n = len(nodes)
    return RodState(
        nodes, poses.multiply(np.array(frames), spins), np.zeros((n, 3)), np.zeros((n - 1, 3))
    )


def _let_go(
    rod: Rod,
    start: RodState,
    left: Pose,
    right: Pose,
    obstacles: Float64[np.ndarray, "m 12"] | None,
) -> Rest:
    durations = np.concatenate([np.full(APPROACH, DURATIONS[0]), DURATIONS])
    actions = np.zeros((len(durations), 2, 6))
    for end, (pose, kind) in enumerate(((left, rod.left), (right, rod.right))):
        if kind == "free":
            continue
        q, p = start.orientations[-end], start.positions[-end]
        turn = poses.logarithm(poses.multiply(pose.orientation, poses.conjugate(q)))
        actions[:APPROACH, end, :3] = (pose.position - p) / (APPROACH * DURATIONS[0])
        actions[:APPROACH, end, 3:] = turn / (APPROACH * DURATIONS[0])
    rollout, stable = rod.settle(start, actions, durations, obstacles)
    residual = float(np.max(np.abs(rollout.positions[-1] - rollout.positions[-2])))
    converged = bool(rollout.converged[-1]) and residual < SETTLED * rod.properties.length
    return Rest(rollout.final.at_rest(), converged, stable, residual)


def _nudged(rod: Rod, state: RodState) -> RodState:
    """The state with a small smooth bump off its plane and off its line."""
    bump = np.sin(np.linspace(0.0, np.pi, rod.node_count)) ** 2
    ripple = np.sin(np.linspace(0.0, 2.0 * np.pi, rod.node_count)) * bump
    offset = bump[:, None] * np.array([0.5, 0.7, -0.3]) + ripple[:, None] * np.array(
        [0.4, -0.6, 0.5]
    )
    moved = state.positions + 0.02 * rod.properties.length * offset
    return RodState(moved, state.orientations, state.velocities, state.angular_velocities)


def check_reach(rod: Rod, left: Pose, right: Pose) -> None:
    if "free" in (rod.left, rod.right):
        return
    z = np.array([0.0, 0.0, 1.0])
    edge = rod.edge_length
    a, b = left.position, right.position
    free = rod.properties.length
    if rod.left == "clamped":
        a = a + edge * poses.rotate(left.orientation, z)
        free -= edge
    if rod.right == "clamped":
        b = b - edge * poses.rotate(right.orientation, z)
        free -= edge
    apart = float(np.linalg.norm(b - a))
    if not np.isfinite(apart):
        raise ValueError(f"grips must be finite, got {left} and {right}")
    if apart > free:
        raise ValueError(
            f"the ends are {apart:.4f} m apart but the rod between them is {free:.4f} m long; "
            "bring the grips together or turn them towards each other"
        )


def _bisected(function: Callable[[float], float], low: float, high: float) -> float:
    """Root of an increasing function, or the nearer limit."""
    for _ in range(60):
        middle = 0.5 * (low + high)
        if function(middle) > 0.0:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)
