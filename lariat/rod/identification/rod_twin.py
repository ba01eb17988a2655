"""A rod in the place of a measured rope: grips, starts and predicted vertices.

A clamp of the rod acts at the middle of its end edge, which lies on the innermost held vertex and
along the two innermost ones; a pin lies on its vertex. A clamp's roll about the rope cannot be
seen: it is taken to turn no more than its axis makes it, from a first frame that is upright.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import poses
from lariat.rod import Rod, RodProperties, RodState, RolloutSpec
from lariat.rod.identification.initial_state import (
    framed,
    inextensible,
    splined,
    transported,
    unstretching,
    upright,
)
from lariat.rod.identification.motion import Motion

LONGEST_STEP = 5.1e-3
"""Of the rod [s]; an implicit step damps as an internal damping of half its length would."""
TAUT = 0.95
"""Share of the distances between neighbours below which slack bends them: the length's quantile."""
ALONG = 0.9
"""Cosine to an axis beyond which it is no reference for a frame [-]."""
TOLERANCE = 1e-6
"""Of a step [m]; derivatives of long roll-outs need no more."""


@dataclass(frozen=True)
class Window:
    """A stretch of one sequence: the rod starts from two frames and is driven from there."""

    sequence: int
    frame: int
    """The second of the two that give the start."""
    length: int
    """How many frames are predicted."""


class Replica:
    """Predicts one measured motion with rods of any material."""

    def __init__(self, motion: Motion, node_count: int | None = None) -> None:
        # One end is always held; it is the left one, or its mirror image.
        self.mirrored = min(motion.right, 2) > min(motion.left, 2)
        if self.mirrored:
            motion = Motion(motion.vertices[:, :, ::-1], motion.dt, motion.right, motion.left)
        self.motion = motion
        spanned = motion.vertices[:, :, motion.spanned]
        self._vertices = spanned
        chords = np.linalg.norm(np.diff(spanned, axis=2), axis=3)
        gaps = np.quantile(chords.reshape(-1, chords.shape[2]), TAUT, axis=0)
        self.arcs: Float64[np.ndarray, "k"] = np.concatenate([[0.0], np.cumsum(gaps)])
        """Arc length of the vertices that the rod spans, from the first of them [m]."""
        self.node_count = node_count or int(np.clip(2 * len(self.arcs), 20, 60))
        self.kinds = _kind(motion.left), _kind(motion.right)
        self.substeps = int(np.ceil(motion.dt / LONGEST_STEP))
        self._outside = 0.5 * np.array([kind == "clamped" for kind in self.kinds])
        edges = self.node_count - 1.0 - self._outside.sum()
        self._at_nodes = (np.arange(self.node_count) - self._outside[0]) / edges
        self._weights = cubic_weights(
            self.arcs / self.arcs[-1] * edges + self._outside[0], self.node_count
        )
        self._frames = self._grip_frames()
        self._starts: dict[float, dict[tuple[int, int], RodState]] = {}

    @property
    def length(self) -> float:
        """Of the rope between the innermost held vertices, as the vertices' distances say [m]."""
        return float(self.arcs[-1])

    def rod_length(self, scale: float) -> float:
        """Of the rod whose part between the grips is `scale` times as long as that [m]."""
        edges = self.node_count - 1.0
        return scale * self.length * edges / (edges - self._outside.sum())

    def of_length(self, properties: RodProperties, scale: float) -> RodProperties:
        """The same material as long as this rope."""
        return replace(properties, length=self.rod_length(scale))

    def windows(self, length: int, first: int = 1) -> list[Window]:
        """Stretches of `length` frames of all sequences, one after the other, from frame `first`.

        What is left over at the end of a sequence is seen by one more that ends there.
        """
        frames = self.motion.vertices.shape[1]
        length = min(length, frames - 1 - first)
        starts = list(range(first, frames - length, length))
        if starts[-1] != frames - 1 - length:
            starts.append(frames - 1 - length)
        return [Window(s, f, length) for s in range(len(self.motion.vertices)) for f in starts]

    def rod(self, properties: RodProperties) -> Rod:
        """The rod of a material, held as the rope is."""
        return Rod(properties, self.node_count, *self.kinds, tolerance=TOLERANCE)

    def measured(self, windows: Sequence[Window]) -> Float64[np.ndarray, "B H k 3"]:
        """The free vertices, left to right, or mirrored [m]."""
        v = self.motion.vertices[:, :, self.motion.free]
        return np.stack([v[w.sequence, w.frame + 1 : w.frame + 1 + w.length] for w in windows])

    def at_free_vertices(
        self, nodes: Float64[np.ndarray, "*b n c"]
    ) -> Float64[np.ndarray, "*b k c"]:
        """Values at the free vertices from those at the nodes, by cubic interpolation."""
        first = 1 if self.motion.left else 0
        last = len(self.arcs) - (1 if self.motion.right else 0)
        return np.einsum("kn,...nc->...kc", self._weights[first:last], nodes)

    def inputs(
        self, properties: RodProperties, windows: Sequence[Window]
    ) -> tuple[list[RodState], Float64[np.ndarray, "B H 2 6"]]:
        """Start and velocities of the grips of each window; all windows are equally long."""
        scale = properties.length / self.rod_length(1.0)
        known = self._starts.setdefault(scale, {})
        missing = [w for w in windows if (w.sequence, w.frame) not in known]
        if missing:
            if len(self._starts) > 4:
                self._starts = {scale: known}
            for w, state in zip(missing, self._states(scale, missing), strict=True):
                known[w.sequence, w.frame] = state
        actions = self._actions(scale)
        return (
            [known[w.sequence, w.frame] for w in windows],
            np.stack([actions[w.sequence, w.frame : w.frame + w.length] for w in windows]),
        )

    def predicted(
        self, properties: RodProperties, windows: Sequence[Window]
    ) -> Float64[np.ndarray, "B H k 3"]:
        """Where the free vertices go [m]."""
        states, actions = self.inputs(properties, windows)
        rolled = self.rod(properties).rollout(
            RolloutSpec(states, actions, self.motion.dt, substeps=self.substeps)
        )
        return self.at_free_vertices(np.stack([r.positions for r in rolled]))

    def linearized(
        self, properties: RodProperties, windows: Sequence[Window], parameters: tuple[str, ...]
    ) -> tuple[Float64[np.ndarray, "B H k 3"], Float64[np.ndarray, "B H k 3 Q"]]:
        """Where the free vertices go, and its slopes in parameters of the rod with starts held."""
        states, actions = self.inputs(properties, windows)
        rod = self.rod(properties)
        answers = []
        for b, state in enumerate(states):
            # One at a time: sensitivities keep every step of their roll-out.
            line = rod.linearize(
                RolloutSpec(state, actions[b], self.motion.dt, substeps=self.substeps),
                parameters,
                with_actions=False,
            )
            nodes = line.rollout.positions
            slopes = line.d_positions_d_parameters.reshape(*nodes.shape[:2], -1)
            slopes = self.at_free_vertices(slopes).reshape(len(nodes), -1, 3, len(parameters))
            answers.append((self.at_free_vertices(nodes), slopes))
        return np.stack([a[0] for a in answers]), np.stack([a[1] for a in answers])

    def restored(
        self, free: Float64[np.ndarray, "B H k 3"], windows: Sequence[Window]
    ) -> Float64[np.ndarray, "B H V 3"]:
        """Predictions of the free vertices among the measured held ones, in the file's order."""
        v = self.motion.vertices
        whole = np.stack([v[w.sequence, w.frame + 1 : w.frame + 1 + w.length] for w in windows])
        whole[:, :, self.motion.free] = free
        return whole[:, :, ::-1] if self.mirrored else whole

    def _edge(self, scale: float) -> float:
        return self.rod_length(scale) / (self.node_count - 1)

    def _grip_frames(self) -> tuple[Float64[np.ndarray, "S T 4"] | None, ...]:
        """Orientation of either clamp at every frame."""
        chain = poses.normalized(np.diff(self._vertices[:, 0], axis=1))
        clamped = self.kinds[0] == "clamped"
        tangents = self.motion.tangents(0) if clamped else chain[:, None, 0]
        left = transported(_upright(tangents[:, 0]), tangents)
        if self.kinds[1] != "clamped":
            return (left if clamped else None), None
        # The right clamp's roll is that of a rope without twist in the first frame.
        along = transported(left[:, 0], np.concatenate([tangents[:, :1], chain], axis=1))[:, -1]
        tangents = self.motion.tangents(1)
        z = np.array([0.0, 0.0, 1.0])
        first = poses.multiply(
            poses.rotation_between(poses.rotate(along, z), tangents[:, 0]), along
        )
        return left, transported(first, tangents)

    def _grip_positions(self, scale: float, end: int) -> Float64[np.ndarray, "S T 3"]:
        """Of the rod's outermost nodes [m]."""
        outer = self._vertices[:, :, -end]
        if self.kinds[end] != "clamped":
            return outer
        return outer + (2 * end - 1) * 0.5 * self._edge(scale) * self.motion.tangents(end)

    def _actions(self, scale: float) -> Float64[np.ndarray, "S T-1 2 6"]:
        v, dt = self._vertices, self.motion.dt
        actions = np.zeros((v.shape[0], v.shape[1] - 1, 2, 6))
        for end, kind in enumerate(self.kinds):
            if kind == "free":
                continue
            actions[:, :, end, :3] = np.diff(self._grip_positions(scale, end), axis=1) / dt
            frames = self._frames[end]
            if frames is not None:
                turns = poses.multiply(frames[:, 1:], poses.conjugate(frames[:, :-1]))
                actions[:, :, end, 3:] = poses.logarithm(turns) / dt
        return actions

    def _states(self, scale: float, windows: Sequence[Window]) -> list[RodState]:
        dt = self.motion.dt
        before, now = (self._chains(scale, windows, back) for back in (1, 0))
        velocities = unstretching(now, (now - before) / dt, self._movable())
        index = tuple(np.array([(w.sequence, w.frame) for w in windows]).T)
        frames = [None if f is None else f[index] for f in self._frames]
        first = frames[0]
        if first is None:
            first = _upright(poses.normalized(now[:, 1] - now[:, 0]))
        orientations = framed(now, first, frames[1])
        earlier = poses.normalized(np.diff(now - dt * velocities, axis=1))
        turns = poses.rotation_between(earlier, poses.normalized(np.diff(now, axis=1)))
        spins = poses.logarithm(turns) / dt
        return [
            RodState(now[b], orientations[b], velocities[b], spins[b]) for b in range(len(windows))
        ]

    def _movable(self) -> Bool[np.ndarray, "n"]:
        movable = np.ones(self.node_count, dtype=bool)
        for kind, ends in zip(self.kinds, ((0, 1), (-1, -2)), strict=True):
            movable[list(ends)] = kind == "free", kind != "clamped"
        return movable

    def _chains(
        self, scale: float, windows: Sequence[Window], back: int
    ) -> Float64[np.ndarray, "B n 3"]:
        """Nodes as the vertices of a frame say [m]."""
        index = tuple(np.array([(w.sequence, w.frame - back) for w in windows]).T)
        slopes = [
            self.motion.tangents(end)[index] if kind == "clamped" else None
            for end, kind in enumerate(self.kinds)
        ]
        nodes = splined(
            scale * self.arcs,
            self._vertices[index],
            slopes[0],
            slopes[1],
            scale * self.length * self._at_nodes,
        )
        for end, (kind, slope) in enumerate(zip(self.kinds, slopes, strict=True)):
            if kind != "free":
                nodes[:, -end] = self._grip_positions(scale, end)[index]
            if slope is not None:
                inward = (1 - 2 * end) * self._edge(scale)
                nodes[:, 1 - 3 * end] = nodes[:, -end] + inward * slope
        return inextensible(nodes, self._edge(scale), self._movable())


def _upright(tangents: Float64[np.ndarray, "B 3"]) -> Float64[np.ndarray, "B 4"]:
    """First axis nearest to the world's x, or to its y where ropes run along x.

    One choice for all of them, so that a rest curvature means the same in every sequence.
    """
    along_x = np.max(np.abs(tangents[:, 0])) > ALONG
    return upright(tangents, np.array([0.0, 1.0, 0.0] if along_x else [1.0, 0.0, 0.0]))


def _kind(held: int) -> str:
    return ("free", "pinned", "clamped")[min(held, 2)]


def cubic_weights(at: Float64[np.ndarray, "k"], count: int) -> Float64[np.ndarray, "k n"]:
    """Weights of Lagrange's cubic through the four nodes around fractional node indices."""
    weights = np.zeros((len(at), count))
    for row, u in zip(weights, at, strict=True):
        first = int(np.clip(np.floor(u) - 1, 0, count - 4))
        near = np.arange(first, first + 4)
        for j in near:
            others = near[near != j]
            row[j] = np.prod((u - others) / (j - others))
    return weights
