"""Initial guesses of a rod's shape: straight, sagging between two grips, along given nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.geometry.poses import Pose
from lariat.rod.model import Dimensions, RodModel
from lariat.rod.state import RodState

EDGE_AXIS = np.array([0.0, 0.0, 1.0])
"""Axis of an edge's frame, and of a grip's, that lies along the rod from left to right."""
MAX_BULGE = 40.0
"""Largest amplitude of the sag of a guess, relative to the rod's length [-]."""
BISECTION_STEPS = 60
"""Halvings of the interval in which a parameter of a guess is searched."""


def straight(
    model: RodModel[Dimensions], left_point: Sequence[float], right_point: Sequence[float]
) -> RodState:
    """Return the straight rod at rest from one point towards another [m].

    The first node lies at `left_point`, the last one at the rod's length from it.

    Raises:
        ValueError: The points coincide or are not finite.
    """
    start, goal = np.asarray(left_point, float), np.asarray(right_point, float)
    along = goal - start
    if not np.all(np.isfinite(along)) or np.linalg.norm(along) < 1e-9:
        raise ValueError(f"straight needs two different points, got {start} and {goal}")
    along = along / np.linalg.norm(along)
    n = model.node_count
    return RodState(
        start + model.edge_length * np.arange(n)[:, None] * along,
        np.tile(poses.rotation_between(EDGE_AXIS, along), (model.frame_count, 1)),
        np.zeros((n, 3)),
        np.zeros((model.frame_count, 3)),
    )


def straight_from_grip(model: RodModel[Dimensions], left: Pose, right: Pose) -> RodState:
    """Return the straight rod that continues the grip opposite to the free end."""
    grip, reach = (left, 1.0) if model.right == "free" else (right, -1.0)
    z = np.array([0.0, 0.0, reach])
    s = model.edge_length * np.arange(model.node_count)[:, None]
    nodes = grip.position + s * poses.rotate(grip.orientation, z)
    if model.right != "free":
        nodes = nodes[::-1]
    return RodState(
        nodes.copy(),
        np.tile(grip.orientation, (model.frame_count, 1)),
        np.zeros_like(nodes),
        np.zeros((model.frame_count, 3)),
    )


def between_grips(
    model: RodModel[Dimensions],
    left: Pose,
    right: Pose,
    bulge_direction: Float64[np.ndarray, "3"] | None = None,
) -> RodState:
    """Return a smooth curve of the rod's length that leaves both grips straight.

    Cubic Hermite curve with a quartic bulge along gravity, or along the given unit direction.
    """
    n, length = model.node_count, model.properties.length
    z = EDGE_AXIS
    a, b = left.position, right.position
    t_a, t_b = poses.rotate(left.orientation, z), poses.rotate(right.orientation, z)
    s = np.linspace(0.0, 1.0, 16 * n)[:, None]
    h00, h10 = 2 * s**3 - 3 * s**2 + 1, s**3 - 2 * s**2 + s
    down = gravity_direction(model) if bulge_direction is None else bulge_direction
    chord = b - a
    if np.linalg.norm(np.cross(chord, down)) < 0.05 * np.linalg.norm(chord) + 1e-9:
        # A chord along gravity leaves no room to sag: bulge sideways.
        down = poses.rotate(left.orientation, np.array([1.0, 0.0, 0.0]))

    def curve(tangent: float, bulge: float) -> Float64[np.ndarray, "k 3"]:
        h01, h11 = 1.0 - h00, s**3 - s**2
        hermite = h00 * a + h01 * b + tangent * (h10 * t_a + h11 * t_b)
        return hermite + bulge * (s - s**2) ** 2 * down

    # Long tangents between near grips would lay a loop, whose linking number differs from that of
    # a hanging rope.
    tangent = min(length, float(np.linalg.norm(chord)))
    if polylines.length(curve(tangent, 0.0)) > length:
        tangent = _bisect(lambda k: polylines.length(curve(k, 0.0)) - length, 0.0, tangent)
    bulge = _bisect(lambda k: polylines.length(curve(tangent, k)) - length, 0.0, MAX_BULGE * length)
    nodes = polylines.resample(curve(tangent, bulge), n)
    return state_along(nodes, left.orientation, right.orientation, model.clamps)


def state_along(
    nodes: Float64[np.ndarray, "n 3"],
    first: Float64[np.ndarray, "4"],
    last: Float64[np.ndarray, "4"],
    clamps: tuple[int, int] = (1, 1),
) -> RodState:
    """Return the state at rest along given nodes, with twist spread evenly between two end frames.

    Frames are transported in parallel along the chain (Bishop frame), then twisted about it by at
    most half a turn in all.

    Args:
        nodes: Node positions [m].
        first: Orientation of the left grip; without a clamp, only its rotation about the first edge
            counts.
        last: Orientation of the right grip; without a clamp, only its rotation about the last edge
            counts.
        clamps: Number of clamps at the left and at the right end, as `RodModel.clamps`.

    Raises:
        ValueError: All nodes are the same point.
    """
    along = tangents(nodes)
    z = EDGE_AXIS
    q = poses.multiply(poses.rotation_between(poses.rotate(first, z), along[0]), first)
    frames = [q]
    for step in poses.rotation_between(along[:-1], along[1:]):
        q = poses.multiply(step, q)
        frames.append(q)
    end = poses.multiply(poses.rotation_between(poses.rotate(last, z), along[-1]), last)
    twist = poses.logarithm(poses.multiply(poses.conjugate(q), end))[2]
    # A clamp lies half an edge beyond the middle of the outermost edge.
    places = np.arange(len(frames)) + 0.5 * clamps[0]
    angles = twist * places / (places[-1] + 0.5 * clamps[1])
    spun = poses.multiply(np.array(frames), poses.exponential(angles[:, None] * z))
    grips = [np.asarray(first, float)] * clamps[0], [np.asarray(last, float)] * clamps[1]
    orientations = np.array([*grips[0], *spun, *grips[1]])
    return RodState(nodes, orientations, np.zeros_like(nodes), np.zeros((len(orientations), 3)))


def tangents(nodes: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, "e 3"]:
    """Return the unit vectors of all edges; an edge without length has that of its neighbour."""
    edges = np.diff(nodes, axis=0)
    lengths = np.linalg.norm(edges, axis=1)
    if lengths.all():
        return edges / lengths[:, None]
    (long,) = np.nonzero(lengths > 0.0)
    if not len(long):
        raise ValueError(
            f"all nodes are the same point, {nodes[0].tolist()} m; give a longer chain"
        )
    nearest = np.abs(np.arange(len(edges))[:, None] - long).argmin(axis=1)
    return (edges[long] / lengths[long, None])[nearest]


def gravity_direction(model: RodModel[Dimensions]) -> Float64[np.ndarray, "3"]:
    """Return the unit vector of gravity; without gravity, the negative z axis."""
    gravity = np.asarray(model.gravity, float)
    return poses.normalized(gravity) if np.any(gravity) else np.array([0.0, 0.0, -1.0])


def check_reach(model: RodModel[Dimensions], left: Pose, right: Pose) -> None:
    """Check that the rod reaches from one grip to the other.

    Raises:
        ValueError: The grips are farther apart than the rod between them is long.
    """
    if "free" in (model.left, model.right):
        return
    length = model.properties.length
    distance = float(np.linalg.norm(right.position - left.position))
    if not np.isfinite(distance):
        raise ValueError(f"grips must be finite, got {left} and {right}")
    if distance > length:
        raise ValueError(
            f"the ends are {distance:.4f} m apart but the rod between them is {length:.4f} m long; "
            "bring the grips together"
        )


def _bisect(function: Callable[[float], float], low: float, high: float) -> float:
    """Return the root of an increasing function, or the nearer limit."""
    for _ in range(BISECTION_STEPS):
        middle = 0.5 * (low + high)
        if function(middle) > 0.0:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)
