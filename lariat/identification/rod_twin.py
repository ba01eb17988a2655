"""Rod twin of a measured rope: grips, initial states and predicted vertices.

A clamp or a pin lies on the innermost held vertex; a clamp has the direction of `Motion.tangents`.
The roll of a clamp about the rope is not measured: its frame is transported in parallel along its
axis from an upright first frame. Where the innermost held vertex is on the rope, the one outside of
it is nearer to the gripper: the frame there is transported in time, and from there along the rope;
and the torsion of the rope between the two acts in series with that of the rod.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import poses
from lariat.identification.initial_state import (
    batch_frames,
    cubic_spline,
    frames_near_reference,
    parallel_transport,
    project_lengths,
    project_velocities,
)
from lariat.identification.motion import Grip, Motion
from lariat.rod import Rod, RodProperties, RodState, RolloutSpec

MAX_TIME_STEP = 10.1e-3
"""Longest step of second order [s]; one of first order would itself damp the rod."""
MAX_LENGTH_FRAMES = 2000
"""Largest number of frames that the lengths between vertices are measured in."""
PIECES_PER_GAP = 16
"""Number of straight pieces that measure a curve between two vertices."""
MAX_REFERENCE_COSINE = 0.9
"""Cosine between tangent and reference axis above which another reference is used [-]."""
SOLVER_TOLERANCE = 1e-6
"""Solver tolerance of a step, sufficient for derivatives of long roll-outs [m]."""


@dataclass(frozen=True)
class Window:
    """Part of one sequence: the rod starts from two frames and is driven from there."""

    sequence: int
    """Index of the sequence."""
    frame: int
    """Second of the two frames that give the initial state."""
    length: int
    """Number of predicted frames."""


class RodTwin:
    """Rods of any material that are driven like one measured rope."""

    def __init__(
        self, motion: Motion, given: Motion | None = None, node_count: int | None = None
    ) -> None:
        """Create the twin of a motion.

        Args:
            motion: Measured motion, which the rod is compared with.
            given: The same motion with less noise, for grips and initial states.
            node_count: Nodes of the rod; by default about twice the number of vertices.
        """
        given = given or motion
        # At least one end is held; the rod is mirrored if the right end is held more firmly.
        self.mirrored = min(motion.right, 2) > min(motion.left, 2)
        if self.mirrored:
            motion, given = motion.mirrored(), given.mirrored()
        self.motion, self.given = motion, given
        spanned = given.vertices[:, :, given.spanned]
        self._vertices = spanned
        self.kinds = _kind(motion.left), _kind(motion.right)
        """Hold of the left and of the right end."""
        self.arcs: Float64[np.ndarray, "k"] = self._arc_lengths()
        """Arc length of the vertices that the rod spans, from the first of them [m]."""
        self.node_count = node_count or int(np.clip(2 * len(self.arcs), 20, 60))
        self._twisting_share = self._share_that_twists()
        self.substeps = int(np.ceil(motion.dt / MAX_TIME_STEP))
        self._at_nodes = np.linspace(0.0, 1.0, self.node_count)
        self._weights = cubic_weights(
            self.arcs / self.arcs[-1] * (self.node_count - 1.0), self.node_count
        )
        self._frames = self._grip_frames()
        self._actions = self._grip_velocities()
        self._starts: dict[float, dict[tuple[int, int], RodState]] = {}

    @property
    def length(self) -> float:
        """Length between the innermost held vertices, estimated from the vertices [m]."""
        return float(self.arcs[-1])

    def refined(self, nodes: int, substeps: int) -> RodTwin:
        """Return a twin with so many times the nodes and the steps."""
        finer = RodTwin(self.motion, self.given, nodes * self.node_count)
        finer.substeps = substeps * self.substeps
        return finer

    def of_other_grip(self) -> RodTwin:
        """Return the twin whose held vertices are of the other kind."""
        grip: Grip = "measured" if self.motion.grip == "clamped" else "clamped"
        return self.of_motion(*(replace(m, grip=grip) for m in (self.motion, self.given)))

    def of_motion(self, motion: Motion, given: Motion) -> RodTwin:
        """Return the twin of another motion, with as many nodes and steps."""
        other = RodTwin(motion, given, self.node_count)
        other.substeps = self.substeps
        return other

    def of_prediction(self, properties: RodProperties, windows: Sequence[Window]) -> RodTwin:
        """Return the twin of the rod's own motion, of which only the vertices are known."""
        vertices, free, dt = self.given.vertices.copy(), self.motion.free, self.motion.dt
        states, _ = self.inputs(properties, windows)
        predicted = self.predict(properties, windows)
        for window, state, after in zip(windows, states, predicted, strict=True):
            sequence, frame = vertices[window.sequence], window.frame
            if frame == 1:
                begin = state.positions - dt * np.array([[[1.0]], [[0.0]]]) * state.velocities
                sequence[:2, free] = self.at_free_vertices(begin)
            sequence[frame + 1 : frame + 1 + window.length, free] = after
        own = replace(self.given, vertices=vertices)
        return self.of_motion(own, own)

    def of_length(self, properties: RodProperties, scale: float) -> RodProperties:
        """Return a material with the length of this rope at a length scale [-]."""
        return replace(properties, length=scale * self.length)

    def windows(self, length: int, first: int = 1) -> list[Window]:
        """Return consecutive windows of `length` frames of all sequences, from frame `first` on.

        The remainder at the end of a sequence is covered by one more window that ends there.
        """
        frames = self.motion.vertices.shape[1]
        length = min(length, frames - 1 - first)
        starts = list(range(first, frames - length, length))
        if starts[-1] != frames - 1 - length:
            starts.append(frames - 1 - length)
        return [Window(s, f, length) for s in range(len(self.motion.vertices)) for f in starts]

    def in_series(self, properties: RodProperties) -> RodProperties:
        """Return a material whose rod twists as much as the rope from gripper to gripper."""
        share = self._twisting_share
        return properties.with_stiffness(
            properties.bending_stiffness, share * properties.twisting_stiffness
        )

    def rod(self, properties: RodProperties) -> Rod:
        """Return the rod of a material, held as the rope is."""
        return Rod(
            self.in_series(properties),
            self.node_count,
            *self.kinds,
            tolerance=SOLVER_TOLERANCE,
            scheme="sdirk2",
        )

    def measured(self, windows: Sequence[Window]) -> Float64[np.ndarray, "B H k 3"]:
        """Return the measured free vertices of windows, in the order of the rod [m]."""
        v = self.motion.vertices[:, :, self.motion.free]
        return np.stack([v[w.sequence, w.frame + 1 : w.frame + 1 + w.length] for w in windows])

    def at_free_vertices(
        self, nodes: Float64[np.ndarray, "*b n c"]
    ) -> Float64[np.ndarray, "*b k c"]:
        """Interpolate values at the nodes at the free vertices, by cubics."""
        first = 1 if self.motion.left else 0
        last = len(self.arcs) - (1 if self.motion.right else 0)
        return np.einsum("kn,...nc->...kc", self._weights[first:last], nodes)

    def inputs(
        self, properties: RodProperties, windows: Sequence[Window]
    ) -> tuple[list[RodState], Float64[np.ndarray, "B H 2 6"]]:
        """Return initial state and grip velocities of each window; windows have equal length."""
        scale = properties.length / self.length
        states = self._starts.setdefault(scale, {})
        missing = [w for w in windows if (w.sequence, w.frame) not in states]
        if missing:
            if len(self._starts) > 4:
                self._starts = {scale: states}
            for w, state in zip(missing, self._states(scale, missing), strict=True):
                states[w.sequence, w.frame] = state
        return (
            [states[w.sequence, w.frame] for w in windows],
            np.stack([self._actions[w.sequence, w.frame : w.frame + w.length] for w in windows]),
        )

    def predict(
        self, properties: RodProperties, windows: Sequence[Window]
    ) -> Float64[np.ndarray, "B H k 3"]:
        """Return the predicted free vertices [m]."""
        states, actions = self.inputs(properties, windows)
        bodies = self.motion.bodies
        rollouts = self.rod(properties).rollout(
            RolloutSpec(states, actions, self.motion.dt, substeps=self.substeps, obstacles=bodies)
        )
        return self.at_free_vertices(np.stack([r.positions for r in rollouts]))

    def linearize(
        self, properties: RodProperties, windows: Sequence[Window], parameters: tuple[str, ...]
    ) -> tuple[Float64[np.ndarray, "B H k 3"], Float64[np.ndarray, "B H k 3 Q"]]:
        """Return the predicted free vertices [m] and their Jacobian in parameters of the rod.

        Initial states and grip motions are held constant.
        """
        states, actions = self.inputs(properties, windows)
        bodies = self.motion.bodies
        rod = self.rod(properties)
        linearized = []
        for b, state in enumerate(states):
            # One at a time: sensitivities keep every step of their roll-out.
            line = rod.linearize(
                RolloutSpec(
                    state, actions[b], self.motion.dt, substeps=self.substeps, obstacles=bodies
                ),
                parameters,
                with_actions=False,
            )
            nodes = line.rollout.positions
            jacobian = line.d_positions_d_parameters.reshape(*nodes.shape[:2], -1)
            jacobian = self.at_free_vertices(jacobian).reshape(len(nodes), -1, 3, len(parameters))
            linearized.append((self.at_free_vertices(nodes), jacobian))
        return np.stack([a[0] for a in linearized]), np.stack([a[1] for a in linearized])

    def all_vertices(
        self, free: Float64[np.ndarray, "B H k 3"], windows: Sequence[Window]
    ) -> Float64[np.ndarray, "B H V 3"]:
        """Return predicted free and measured held vertices, in the order of the measurement [m]."""
        v = self.motion.vertices
        whole = np.stack([v[w.sequence, w.frame + 1 : w.frame + 1 + w.length] for w in windows])
        whole[:, :, self.motion.free] = free
        return whole[:, :, ::-1] if self.mirrored else whole

    def _arc_lengths(self) -> Float64[np.ndarray, "k"]:
        """Return the arc length of the vertices [m].

        It is the median over the frames of lengths along splines. Distances between vertices
        are shorter where the rope is bent: by 1 % in a bend whose radius is twice the distance.
        """
        count = self._vertices.shape[2]
        frames = self._vertices.reshape(-1, count, 3)
        every = max(1, len(frames) // MAX_LENGTH_FRAMES)
        frames = frames[::every]
        tangents = [
            self.given.tangents(end).reshape(-1, 3)[::every] if kind == "clamped" else None
            for end, kind in enumerate(self.kinds)
        ]
        gaps = np.median(np.linalg.norm(np.diff(frames, axis=1), axis=2), axis=0)
        knots = np.concatenate([[0.0], np.cumsum(gaps)])
        places = np.interp(
            np.linspace(0.0, count - 1.0, (count - 1) * PIECES_PER_GAP + 1), np.arange(count), knots
        )
        curve = cubic_spline(knots, frames, tangents[0], tangents[1], places)
        pieces = np.linalg.norm(np.diff(curve, axis=1), axis=2)
        lengths = pieces.reshape(len(frames), count - 1, PIECES_PER_GAP).sum(axis=2)
        return np.concatenate([[0.0], np.cumsum(np.median(lengths, axis=0))])

    def _share_that_twists(self) -> float:
        """Return the length of the rod by that of the rope that twists between grippers [-]."""
        if self.motion.grip == "clamped":
            return 1.0
        gaps = np.median(np.linalg.norm(np.diff(self.given.vertices, axis=2), axis=3), axis=(0, 1))
        beyond = [
            gaps[outer]
            for kind, outer in zip(
                self.kinds, (self.motion.left - 2, -self.motion.right + 1), strict=True
            )
            if kind == "clamped"
        ]
        return float(self.length / (self.length + sum(beyond)))

    def _grip_frames(self) -> tuple[Float64[np.ndarray, "S T 4"] | None, ...]:
        """Return the orientation of each clamp at every frame; None for other ends."""
        chain = poses.normalized(np.diff(self._vertices[:, 0], axis=1))
        clamped = self.kinds[0] == "clamped"
        tangents = self.given.tangents(0) if clamped else chain[:, None, 0]
        left = self._transported(0, _upright(tangents[:, 0]), tangents)
        if self.kinds[1] != "clamped":
            return (left if clamped else None), None
        # The rope has no twist in the first frame, which gives the roll of the right clamp.
        along = parallel_transport(left[:, 0], np.concatenate([tangents[:, :1], chain], axis=1))[
            :, -1
        ]
        tangents = self.given.tangents(1)
        z = np.array([0.0, 0.0, 1.0])
        first = poses.multiply(
            poses.rotation_between(poses.rotate(along, z), tangents[:, 0]), along
        )
        return left, self._transported(1, first, tangents)

    def _transported(
        self, end: int, first: Float64[np.ndarray, "S 4"], tangents: Float64[np.ndarray, "S T 3"]
    ) -> Float64[np.ndarray, "S T 4"]:
        """Return the orientations of a clamp, whose gripper does not roll, by its first ones."""
        if self.motion.grip == "clamped" or self.kinds[end] != "clamped":
            return parallel_transport(first, tangents)
        outside = self.given.tangents(end, outside=True)
        back = poses.rotation_between(tangents[:, 0], outside[:, 0])
        frames = parallel_transport(poses.multiply(back, first), outside)
        return poses.multiply(poses.rotation_between(outside, tangents), frames)

    def _grip_velocities(self) -> Float64[np.ndarray, "S T-1 2 6"]:
        """Return linear and angular velocities of both grips between frames [m/s, rad/s]."""
        v, dt = self._vertices, self.motion.dt
        actions = np.zeros((v.shape[0], v.shape[1] - 1, 2, 6))
        for end, kind in enumerate(self.kinds):
            if kind == "free":
                continue
            actions[:, :, end, :3] = np.diff(v[:, :, -end], axis=1) / dt
            frames = self._frames[end]
            if frames is not None:
                turns = poses.multiply(frames[:, 1:], poses.conjugate(frames[:, :-1]))
                actions[:, :, end, 3:] = poses.logarithm(turns) / dt
        return actions

    def _states(self, scale: float, windows: Sequence[Window]) -> list[RodState]:
        dt = self.motion.dt
        previous, current = (self._chains(scale, windows, back) for back in (1, 0))
        velocities = project_velocities(current, (current - previous) / dt, self._movable())
        index = tuple(np.array([(w.sequence, w.frame) for w in windows]).T)
        frames = [None if f is None else f[index] for f in self._frames]
        first = frames[0]
        if first is None:
            first = _upright(poses.normalized(current[:, 1] - current[:, 0]))
        clamps = self.kinds[0] == "clamped", self.kinds[1] == "clamped"
        orientations = batch_frames(current, first, frames[1], clamps)
        earlier = poses.normalized(np.diff(current - dt * velocities, axis=1))
        turns = poses.rotation_between(earlier, poses.normalized(np.diff(current, axis=1)))
        spins = poses.logarithm(turns) / dt
        grips = [self._actions[index][:, None, end, 3:] for end in (0, 1)]
        spins = np.concatenate([*grips[: clamps[0]], spins, *grips[2 - clamps[1] :]], axis=1)
        return [
            RodState(current[b], orientations[b], velocities[b], spins[b])
            for b in range(len(windows))
        ]

    def _movable(self) -> Bool[np.ndarray, "n"]:
        movable = np.ones(self.node_count, dtype=bool)
        for kind, end in zip(self.kinds, (0, -1), strict=True):
            movable[end] = kind == "free"
        return movable

    def _chains(
        self, scale: float, windows: Sequence[Window], back: int
    ) -> Float64[np.ndarray, "B n 3"]:
        """Return nodes of rods through the vertices, `back` frames before each window [m]."""
        index = tuple(np.array([(w.sequence, w.frame - back) for w in windows]).T)
        tangents = [
            self.given.tangents(end)[index] if kind == "clamped" else None
            for end, kind in enumerate(self.kinds)
        ]
        nodes = cubic_spline(
            scale * self.arcs,
            self._vertices[index],
            tangents[0],
            tangents[1],
            scale * self.length * self._at_nodes,
        )
        for end, kind in enumerate(self.kinds):
            if kind != "free":
                nodes[:, -end] = self._vertices[:, :, -end][index]
        edge = scale * self.length / (self.node_count - 1)
        return project_lengths(nodes, edge, self._movable())


def _upright(tangents: Float64[np.ndarray, "B 3"]) -> Float64[np.ndarray, "B 4"]:
    """Return frames whose first axis is nearest to the world's x, or to y if a rope runs along x.

    The choice is common to all, so that a rest curvature means the same in every sequence.
    """
    along_x = np.max(np.abs(tangents[:, 0])) > MAX_REFERENCE_COSINE
    return frames_near_reference(
        tangents, np.array([0.0, 1.0, 0.0] if along_x else [1.0, 0.0, 0.0])
    )


def _kind(held: int) -> str:
    return ("free", "pinned", "clamped")[min(held, 2)]


def cubic_weights(at: Float64[np.ndarray, "k"], count: int) -> Float64[np.ndarray, "k n"]:
    """Return the weights of Lagrange's cubic through the four nodes around fractional indices.

    Args:
        at: Fractional node indices.
        count: Number of nodes.
    """
    weights = np.zeros((len(at), count))
    for row, u in zip(weights, at, strict=True):
        first = int(np.clip(np.floor(u) - 1, 0, count - 4))
        near = np.arange(first, first + 4)
        for j in near:
            others = near[near != j]
            row[j] = np.prod((u - others) / (j - others))
    return weights
