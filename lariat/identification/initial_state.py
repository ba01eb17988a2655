"""State of a rod from the positions of a few vertices on it.

A cubic spline over arc length, the curve of least bending, interpolates the rope and is projected
to the nearest chain whose edges have their rest length. Frames are transported in parallel along
the chain, with the twist that the clamps impose.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import poses

MAX_PROJECTIONS = 25
"""Largest number of Newton iterations of the projection to rest lengths."""


def cubic_spline(
    knots: Float64[np.ndarray, "V"],
    values: Float64[np.ndarray, "B V 3"],
    first: Float64[np.ndarray, "B 3"] | None,
    last: Float64[np.ndarray, "B 3"] | None,
    at: Float64[np.ndarray, "n"],
) -> Float64[np.ndarray, "B n 3"]:
    """Return cubic splines through values at knots, with given end tangents or natural ends.

    Args:
        knots: Arc lengths of the values [m].
        values: Points at the knots [m].
        first: Tangents at the first knot; None for a natural end.
        last: Tangents at the last knot; None for a natural end.
        at: Arc lengths to interpolate at; beyond the knots the curve is straight [m].
    """
    h = np.diff(knots)
    count = len(knots)
    system = np.zeros((count, count))
    right_side = np.zeros((len(values), count, 3))
    secants = np.diff(values, axis=1) / h[:, None]
    for k in range(1, count - 1):
        system[k, k - 1 : k + 2] = 1.0 / h[k - 1], 2.0 / h[k - 1] + 2.0 / h[k], 1.0 / h[k]
        right_side[:, k] = 3.0 * (secants[:, k - 1] / h[k - 1] + secants[:, k] / h[k])
    for row, near, gap, given in ((0, 1, 0, first), (count - 1, count - 2, -1, last)):
        if given is None:
            system[row, row], system[row, near] = 2.0, 1.0
            right_side[:, row] = 3.0 * secants[:, gap]
        else:
            system[row, row] = 1.0
            right_side[:, row] = given
    m = np.einsum("ij,bjc->bic", np.linalg.inv(system), right_side)
    k = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, count - 2)
    gap = h[k][:, None]
    t = (at - knots[k])[:, None] / gap
    inside = np.clip(t, 0.0, 1.0)
    s = inside
    curve = (
        (2 * s**3 - 3 * s**2 + 1) * values[:, k]
        + (s**3 - 2 * s**2 + s) * gap * m[:, k]
        + (3 * s**2 - 2 * s**3) * values[:, k + 1]
        + (s**3 - s**2) * gap * m[:, k + 1]
    )
    beyond = (t - inside) * gap
    return curve + beyond * np.where(t > 1.0, m[:, k + 1], m[:, k])


def project_lengths(
    nodes: Float64[np.ndarray, "B n 3"], edge: float, movable: Bool[np.ndarray, "n"]
) -> Float64[np.ndarray, "B n 3"]:
    """Return the nearest chains [m] with edges of length `edge` [m]; only movable nodes move."""
    for _ in range(MAX_PROJECTIONS):
        d = np.diff(nodes, axis=1)
        stretch = np.sum(d * d, axis=2) - edge**2
        loose = movable[1:] | movable[:-1]
        if np.max(np.abs(stretch[:, loose]), initial=0.0) < 1e-7 * edge**2:
            break
        nodes = nodes - 0.5 * _corrections(d, stretch, movable)
    return nodes


def project_velocities(
    nodes: Float64[np.ndarray, "B n 3"],
    velocities: Float64[np.ndarray, "B n 3"],
    movable: Bool[np.ndarray, "n"],
) -> Float64[np.ndarray, "B n 3"]:
    """Return the nearest velocities that keep the length of every edge [m/s]."""
    d = np.diff(nodes, axis=1)
    rate = np.sum(d * np.diff(velocities, axis=1), axis=2)
    return velocities - _corrections(d, rate, movable)


def _corrections(
    d: Float64[np.ndarray, "B m 3"],
    wanted: Float64[np.ndarray, "B m"],
    movable: Bool[np.ndarray, "n"],
) -> Float64[np.ndarray, "B n 3"]:
    """Return the least displacements c of movable nodes with d . (c_i+1 - c_i) = wanted."""
    w = movable.astype(float)
    m = d.shape[1]
    system = np.zeros((len(d), m, m))
    at = np.arange(m)
    system[:, at, at] = (w[1:] + w[:-1]) * np.sum(d * d, axis=2)
    between = -w[1:-1] * np.sum(d[:, 1:] * d[:, :-1], axis=2)
    system[:, at[1:], at[:-1]] = between
    system[:, at[:-1], at[1:]] = between
    stiff = (w[1:] + w[:-1]) == 0.0
    system[:, at[stiff], at[stiff]] = 1.0
    # The system of a taut chain is singular: regularize it.
    system[:, at, at] *= 1.0 + 1e-4
    share = np.linalg.solve(system, (wanted * ~stiff)[..., None])
    moves = np.zeros((len(d), m + 1, 3))
    moves[:, 1:] += share * d
    moves[:, :-1] -= share * d
    return w[:, None] * moves


def batch_frames(
    nodes: Float64[np.ndarray, "B n 3"],
    first: Float64[np.ndarray, "B 4"],
    last: Float64[np.ndarray, "B 4"] | None,
    clamps: tuple[bool, bool],
) -> Float64[np.ndarray, "B m 4"]:
    """Return orientations along chains, with twist spread evenly between two end frames.

    Args:
        nodes: Nodes of the chains [m].
        first: Orientations of the first grips.
        last: Orientations of the last grips; None for chains without twist.
        clamps: Whether the first and the last end are clamped, which adds the frames of the grips.
    """
    z = np.array([0.0, 0.0, 1.0])
    tangents = poses.normalized(np.diff(nodes, axis=1))
    q = poses.multiply(poses.rotation_between(poses.rotate(first, z), tangents[:, 0]), first)
    chain = [q]
    for k in range(1, tangents.shape[1]):
        q = poses.multiply(poses.rotation_between(tangents[:, k - 1], tangents[:, k]), q)
        chain.append(q)
    frames = np.stack(chain, axis=1)
    if last is not None:
        end = poses.multiply(poses.rotation_between(poses.rotate(last, z), tangents[:, -1]), last)
        twist = poses.logarithm(poses.multiply(poses.conjugate(q), end))[:, 2]
        places = np.arange(tangents.shape[1]) + 0.5 * clamps[0]
        angles = twist[:, None] * places / (places[-1] + 0.5 * clamps[1])
        frames = poses.multiply(frames, poses.exponential(angles[..., None] * z))
    if clamps[0]:
        frames = np.concatenate([first[:, None], frames], axis=1)
    if clamps[1] and last is not None:
        frames = np.concatenate([frames, last[:, None]], axis=1)
    return poses.normalized(frames)


def parallel_transport(
    first: Float64[np.ndarray, "B 4"], tangents: Float64[np.ndarray, "B T 3"]
) -> Float64[np.ndarray, "B T 4"]:
    """Return the first frames transported in parallel to all tangents."""
    turns = poses.rotation_between(tangents[:, :-1], tangents[:, 1:])
    q = first
    frames = [q]
    for k in range(turns.shape[1]):
        q = poses.normalized(poses.multiply(turns[:, k], q))
        frames.append(q)
    return np.stack(frames, axis=1)


def frames_near_reference(
    tangents: Float64[np.ndarray, "B 3"], reference: Float64[np.ndarray, "3"]
) -> Float64[np.ndarray, "B 4"]:
    """Return frames whose third axis is the tangent and whose first is nearest to a reference."""
    frames = []
    for t in tangents:
        d1 = reference - (reference @ t) * t
        d1 = d1 / np.linalg.norm(d1)
        frames.append(poses.from_matrix(np.stack([d1, np.cross(t, d1), t], axis=1)))
    return np.array(frames)
