"""Measured motion of a rope with driven ends."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import poses
from lariat.identification.smoothing import smoothed

Grip = Literal["clamped", "measured"]
"""Direction of the rope at the innermost of two or more held vertices.

`clamped`: the gripper holds both vertices, and the rope leaves it along them. `measured`: they are
on the rope, which bends between them; it has the tangent of a cubic through the nearest vertices.
"""

MAX_ROPE_LENGTH = 100.0
"""Length above which the vertices are assumed not to be in metres [m]."""
USUAL_ROPE_LENGTH = 5.0
"""Length above which other units than metres are likely [m]."""
MIN_FRAMES = 10
"""Smallest number of frames of a sequence."""
MIN_SAG = 0.02
"""Mean distance from the line between the held vertices that tells gravity, by the length [-]."""
MIN_SHARE_OF_Z = 0.8
"""Share of z in this distance below which z does not seem to point up [-]."""
AXES = ("x", "y", "z")
Up = Literal["x", "y", "z", "-x", "-y", "-z"]
"""Axis of a file that points up."""


@dataclass(frozen=True)
class Motion:
    """Vertices on a rope over time, in a frame whose z axis points up.

    Held vertices are inputs, known at every frame: the first ones at the left end, the last ones at
    the right end, or both. One held vertex is a pin; two or more prescribe the position of the
    innermost one and the direction of the rope there, which follows from `grip`.
    """

    vertices: Float64[np.ndarray, "S T V 3"]
    """Vertices of S sequences of T frames [m]."""
    dt: float
    """Time between frames [s]."""
    left: int
    """Number of held vertices at the left end."""
    right: int
    """Number of held vertices at the right end."""
    grip: Grip = "clamped"
    """Direction of the rope at its held vertices."""
    tangent_vertices: int = 4
    """Vertices at an end whose polynomial has the tangents of a `measured` grip."""

    bodies: Float64[np.ndarray, "m 13"] | None = None
    """Bodies that the rope touches, packed by `lariat.geometry.pack`."""

    @property
    def free(self) -> Bool[np.ndarray, "V"]:
        """Mask of the vertices that are not held."""
        count = self.vertices.shape[2]
        at = np.arange(count)
        return (at >= self.left) & (at < count - self.right)

    @property
    def spanned(self) -> slice:
        """Slice of the free vertices and of the held ones next to them."""
        return slice(max(self.left - 1, 0), self.vertices.shape[2] - max(self.right - 1, 0))

    def until(self, frames: int) -> Motion:
        """Return the first frames of every sequence."""
        return replace(self, vertices=self.vertices[:, :frames])

    def mirrored(self) -> Motion:
        """Return the motion with the order of the vertices reversed."""
        return replace(self, vertices=self.vertices[:, :, ::-1], left=self.right, right=self.left)

    def smoothed(self) -> Motion:
        """Return the motion without the noise that differs from frame to frame."""
        return replace(self, vertices=smoothed(self.vertices)[0])

    def noise(self) -> Float64[np.ndarray, "V"]:
        """Return the standard deviation of that noise, for a coordinate of each vertex [m]."""
        return smoothed(self.vertices)[1]

    def tangents(self, end: int, outside: bool = False) -> Float64[np.ndarray, "S T 3"]:
        """Return unit vectors along the rope, from left to right, at a held vertex.

        Args:
            end: End of the rope, 0 left and 1 right.
            outside: Whether at the vertex outside of the innermost held one, not at that itself.
        """
        inner = self.left - 1 if end == 0 else -self.right
        outer = inner - 1 if end == 0 else inner + 1
        if self.grip == "measured":
            return self._measured_tangents(inner, outer if outside else inner)
        along = self.vertices[:, :, inner] - self.vertices[:, :, outer]
        return poses.normalized(along if end == 0 else -along)

    def _measured_tangents(self, inner: int, vertex: int) -> Float64[np.ndarray, "S T 3"]:
        """Return unit tangents at a vertex, of the polynomial through those at that end."""
        steps = np.arange(-1, self.tangent_vertices - 1)
        at = (inner + (steps if inner >= 0 else -steps[::-1])).tolist()
        near = self.vertices[:, :, at]
        gaps = np.median(np.linalg.norm(np.diff(near, axis=2), axis=3), axis=(0, 1))
        arcs = np.concatenate([[0.0], np.cumsum(gaps)])
        # Row 1 of the inverse Vandermonde matrix: the derivative at arc length zero.
        weights = np.linalg.inv(np.vander(arcs - arcs[at.index(vertex)], increasing=True))[1]
        return poses.normalized(np.einsum("k,stkc->stc", weights, near))


def with_z_up(vertices: Float64[np.ndarray, "*s 3"], up: Up) -> Float64[np.ndarray, "*s 3"]:
    """Return positions in a right-handed frame whose z axis is the one that points up."""
    sign = -1.0 if up.startswith("-") else 1.0
    k = AXES.index(up[-1])
    # The axes that follow keep their order, so that the frame stays right-handed.
    x, y = (vertices[..., (k + 1) % 3], sign * vertices[..., (k + 2) % 3])
    return np.stack([x, y, sign * vertices[..., k]], axis=-1)


def doubts(motion: Motion) -> tuple[str, ...]:
    """Return a line about each convention of a motion that gravity or its size contradict."""
    lines = []
    v = motion.vertices
    length = float(np.median(np.linalg.norm(np.diff(v, axis=2), axis=3).sum(axis=2)))
    if length > USUAL_ROPE_LENGTH:
        lines.append(
            f"the rope is {length:.4g} m long; if vertices are in other units, give --scale 0.001 "
            "for mm, 0.01 for cm, 0.0254 for inches"
        )
    sag = _sag(motion)
    k = int(np.argmax(np.abs(sag)))
    size = float(np.linalg.norm(sag))
    if size > MIN_SAG * length and -sag[2] < MIN_SHARE_OF_Z * size:
        down, up = ("", "-") if sag[k] > 0.0 else ("-", "")
        along = abs(sag[k]) > 0.9 * size
        towards = f"{down}{AXES[k]}" if along else np.array2string(sag / size, precision=2)
        remedy = f"give --up {up}{AXES[k]}" if along else "turn the vertices"
        lines.append(
            f"the rope hangs towards {towards}, by {1e3 * size:.0f} mm on average, and z is taken "
            f"for up; {remedy}"
        )
    return tuple(lines)


def _sag(motion: Motion) -> Float64[np.ndarray, "3"]:
    """Mean of the free vertices from the line between the held ones, or from the only one [m]."""
    v = motion.vertices
    first, last = motion.left - 1, v.shape[2] - motion.right
    ends = v[:, :, max(first, 0)], v[:, :, min(last, v.shape[2] - 1)]
    free = v[:, :, motion.free]
    if motion.left and motion.right:
        share = np.linspace(0.0, 1.0, free.shape[2] + 2)[1:-1, None]
        line = (1.0 - share) * ends[0][:, :, None] + share * ends[1][:, :, None]
    else:
        line = ends[0 if motion.left else 1][:, :, None]
    return (free - line).mean(axis=(0, 1, 2))


def check_motion(
    vertices: object, dt: object, prescribed: object, grip: Grip = "clamped"
) -> Motion:
    """Check the contents of a file and return them as a motion.

    Args:
        vertices: Array of shape (S, T, V, 3) [m].
        dt: Time between frames [s].
        prescribed: Indices of the held vertices.
        grip: Direction of the rope where two or more vertices are held.

    Raises:
        ValueError: An argument has the wrong shape, type or range.
    """
    v = np.asarray(vertices)
    if v.ndim != 4 or v.shape[3] != 3:
        raise ValueError(
            f"vertices must be (sequences, frames, vertices, 3), got shape {v.shape}; one sequence "
            "is vertices[None]"
        )
    if not np.issubdtype(v.dtype, np.number) or np.iscomplexobj(v):
        raise ValueError(f"vertices must be numbers, got {v.dtype}")
    v = v.astype(np.float64)
    sequences, frames, count, _ = v.shape
    if sequences < 1 or frames < MIN_FRAMES or count < 3:
        raise ValueError(
            f"vertices must hold at least 1 sequence of {MIN_FRAMES} frames of 3 vertices, got "
            f"{sequences} of {frames} of {count}"
        )
    bad = np.argwhere(~np.isfinite(v).all(axis=3))
    if len(bad):
        s, t, k = bad[0]
        raise ValueError(
            f"vertices[{s}, {t}, {k}] is {v[s, t, k]}, one of {len(bad)} that are not finite; fill "
            "gaps or cut the sequence there"
        )
    step = np.asarray(dt)
    if step.size != 1 or not np.issubdtype(step.dtype, np.number):
        raise ValueError(f"dt must be one number of seconds, got {dt}")
    step = float(step.reshape(()))
    if not (np.isfinite(step) and 0.0 < step <= 1.0):
        raise ValueError(f"dt must be between 0 and 1 s, got {step} s; 100 Hz is 0.01")
    left, right = _held_counts(prescribed, count)
    chords = np.linalg.norm(np.diff(v, axis=2), axis=3)
    s, t, k = np.unravel_index(int(np.argmin(chords)), chords.shape)
    if chords[s, t, k] < 1e-6:
        raise ValueError(
            f"vertices {k} and {k + 1} of sequence {s} coincide in frame {t}; every vertex needs "
            "a place of its own on the rope"
        )
    length = float(np.median(chords.sum(axis=2)))
    if length > MAX_ROPE_LENGTH:
        raise ValueError(
            f"the rope would be {length:.4g} m long; vertices are in metres (of millimetres, "
            "--scale 0.001 makes them)"
        )
    if grip == "measured" and count < 5:
        raise ValueError(f"measured grips need at least 5 vertices, got {count}")
    return Motion(v, step, left, right, grip)


def _held_counts(prescribed: object, count: int) -> tuple[int, int]:
    """Return the number of held vertices at the left and at the right end."""
    vertices = np.asarray(prescribed)
    if vertices.dtype == bool and vertices.shape == (count,):
        (vertices,) = np.nonzero(vertices)
    if vertices.ndim != 1 or not (np.issubdtype(vertices.dtype, np.integer) or vertices.size == 0):
        raise ValueError(f"prescribed must be a row of vertex indices, got {prescribed}")
    if vertices.size == 0:
        raise ValueError("prescribed is empty; a rope that nothing holds cannot be rolled out")
    if np.any(vertices < -count) or np.any(vertices >= count):
        raise ValueError(f"prescribed must lie within 0 and {count - 1}, got {vertices.tolist()}")
    mask = np.zeros(count, dtype=bool)
    mask[vertices] = True
    if mask.all():
        raise ValueError("all vertices are prescribed; nothing is left to predict")
    (free,) = np.nonzero(~mask)
    if not np.array_equal(free, np.arange(free[0], free[-1] + 1)):
        raise ValueError(
            f"prescribed must be vertices at the ends, such as [0, 1, {count - 2}, {count - 1}], "
            f"got {sorted(set(vertices.tolist()))}; vertices held in the middle are not supported"
        )
    return int(free[0]), int(count - 1 - free[-1])
