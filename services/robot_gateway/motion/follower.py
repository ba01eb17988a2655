"""The commanded motion of a cell: chunks in, poses within every rule out.

It decides where the grips shall be; whether they may move at all is `safety.py`'s matter.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.trajectory import (
    NANOSECONDS,
    Blend,
    MotionLimits,
    MotionState,
    SetpointChunk,
    Spline,
)
from services.robot_gateway.constraints.joints import STRIDE, Posture, tried
from services.robot_gateway.constraints.motion_constraints import Boundaries, Rules, broken
from services.robot_gateway.constraints.rule import Rule
from services.robot_gateway.constraints.sphere_distance import Spheres, distances
from services.robot_gateway.motion import validation
from services.robot_gateway.motion.path_densification import densely, stop_times
from services.robot_gateway.motion.reference_tracking import (
    Braking,
    Follower,
)
from services.robot_gateway.motion.validation import Refused, Tolerances
from shared.motion_contract import CHUNK_BOUNDARY_MARGIN

NEAR = (1e-4, 3e-4)
"""Distance and angle up to which the command is where its chunk ends [m, rad]."""
INSTANTS = 8
"""Of the rest of a chunk that must all be where the command is, if it has arrived."""
UNITS: dict[Rule, str] = {"joint_limits": "rad", "joint_speed": "rad/s", "singularity": "m/rad"}
BLEND = (0.06, 0.3)
"""Least and most time in which a chunk takes over from the motion before it [s]."""


class Guidance:
    """Commanded poses of all ends of a cell."""

    def __init__(
        self,
        limits: MotionLimits,
        boundaries: Boundaries,
        starts: Sequence[Pose],
        driven: Sequence[int],
        postures: Sequence[Posture | None] = (),
        tolerances: Tolerances | None = None,
    ) -> None:
        """Args: starts: Of all ends. driven: Those that move. postures: Of the driven ends."""
        self.postures = [(k, p) for k, p in enumerate(postures) if p is not None]
        self.tolerances = tolerances or Tolerances()
        self.driven = list(driven)
        self.limits = limits
        self.follower = Follower(self.limits)
        self.rules = Rules(boundaries, self.driven)
        self.place(starts)

    def place(self, grips: Sequence[Pose]) -> None:
        """Puts the command at rest at the given poses of all ends."""
        self._time: int | None = None
        self._positions = np.array([g.position for g in grips], dtype=float)
        self._orientations = np.array([g.orientation for g in grips], dtype=float)
        self.state = MotionState.at_rest(*(grips[k] for k in self.driven))
        self._braking = Braking(self.follower.stop(self.state))
        self._reference: Blend | None = None

    @property
    def resting(self) -> bool:
        """Whether the command stands still."""
        return self.state.resting

    @property
    def following(self) -> bool:
        """Whether a chunk is being followed."""
        return self._reference is not None

    def arrived(self, now: int) -> bool:
        """Whether the command is where its chunk stays; braking may have let it rest before."""
        if self._reference is None:
            return self.resting
        left = max(self._reference.end - now, 0)
        ahead = [now + left * k // INSTANTS for k in range(INSTANTS + 1)]
        gaps = np.array([self._behind(at) for at in ahead])
        still = np.all(np.abs(self.state.twists) < 1e-3)
        return bool(np.all(gaps < NEAR) and still)

    def finished(self, now: int) -> bool:
        """Whether the chunk's resting end has been reached."""
        return self._reference is not None and now >= self._reference.end and self.arrived(now)

    def behind(self, now: int) -> tuple[float, float]:
        """Between the command and its chunk, the farthest end [m, rad]."""
        if self._reference is None or not self.driven:
            return 0.0, 0.0
        return self._behind(now)

    def _behind(self, now: int) -> tuple[float, float]:
        assert self._reference is not None
        there = self._reference(now)
        back = poses.conjugate(self.state.orientations)
        turn = poses.logarithm(poses.multiply(there.orientations, back))
        gap = there.positions - self.state.positions
        return _longest(gap), _longest(turn)

    def check(self, chunk: SetpointChunk, now: int, offset: int = 0) -> Spline:
        """The curve of a chunk that may be followed from now on.

        Args:
            offset: From the writer's clock to ours [ns].

        Raises:
            Refused: With the rule that the chunk breaks.
        """
        validation.check_finite(chunk, len(self.driven), self.tolerances)
        validation.check_fresh(chunk, now, offset, self.tolerances)
        spline = Spline(chunk, chunk.start + offset)
        validation.check_limits(spline, now, self.limits, self.tolerances)
        past = int((now - spline.start) * NANOSECONDS / spline.dt)
        first = min(max(past, 0), spline.count - 1)
        ahead = chunk.positions[first:], chunk.orientations[first:]
        found = self._broken(*densely(*ahead), CHUNK_BOUNDARY_MARGIN) or self._broken_bodies(
            *ahead, CHUNK_BOUNDARY_MARGIN, spline.dt
        )
        if found:
            rule, excess = found
            raise Refused(rule, f"broken by {excess:.4f} {UNITS.get(rule, 'm')}")
        validation.check_step(spline, self._time or now, self.state, self.tolerances)
        return spline

    def follow(self, spline: Spline, now: int) -> None:
        """Takes over from the present motion to a checked curve."""
        # The motion is known at the last tick, not when a message happens to arrive.
        now = self._time or now
        target = spline(now)
        gap = np.linalg.norm(target.positions - self.state.positions, axis=-1)
        slip = np.linalg.norm(target.twists[:, 0] - self.state.twists[:, 0], axis=-1)
        limit = self.limits.acceleration
        wanted = np.maximum(np.sqrt(11.5 * gap / limit), 4.0 * slip / limit)
        duration = float(np.clip(np.max(wanted, initial=0.0), *BLEND))
        self._reference = Blend(spline, self.state, now, duration)

    def halt(self) -> None:
        """Begins the stop that has been checked."""
        self._reference = None

    def step(self, before: int, now: int, ease: bool = False) -> Rule | None:
        """Moves the command from one time to another [ns]; the rule that slowed it, if any.

        Args:
            ease: Brake, but keep the chunk: the next one takes over from wherever that leads.
        """
        h = (now - before) * NANOSECONDS
        self._time = now
        rule = None
        if self._reference is not None and not ease:
            present = self._reference(before)
            wanted = self.follower.step(self.state, present, self._reference(now), h)
            braking = Braking(self.follower.stop(wanted))
            rule = self._forbidden(wanted, braking)
            if rule is None:
                self.state, self._braking = wanted, braking
                self._track()
                return None
        if not self.state.resting:
            self.state, self._braking = self._braking.step(self.state, h)
            self._track()
        return rule

    def _track(self) -> None:
        for k, posture in self.postures:
            posture.track(Pose(self.state.positions[k], self.state.orientations[k]))

    def grips(self) -> list[tuple[Pose, Float64[np.ndarray, "2 3"]]]:
        """Commanded pose and velocity of every driven end."""
        s = self.state
        return [
            (Pose(p, q), v) for p, q, v in zip(s.positions, s.orientations, s.twists, strict=True)
        ]

    def _forbidden(self, state: MotionState, braking: Braking) -> Rule | None:
        """The rule that a state or the stop after it breaks."""
        if self.follower.too_fast(state):
            return "speed"
        moved = braking.stop.at(stop_times(braking.stop))[0]
        path = (
            state.positions + moved[:, :, 0],
            poses.multiply(poses.exponential(moved[:, :, 1]), state.orientations[None]),
        )
        for k, posture in self.postures:
            grip = Pose(state.positions[k], state.orientations[k])
            if posture.too_fast(grip, state.twists[k]):
                return "joint_speed"
        found = self._broken(*path) or self._broken_bodies(*path)
        return found[0] if found else None

    def _broken_bodies(
        self,
        positions: Float64[np.ndarray, "m driven 3"],
        orientations: Float64[np.ndarray, "m driven 4"],
        margin: float = 0.0,
        dt: float | None = None,
    ) -> tuple[Rule, float] | None:
        """The rule that the joints and bodies of the arms break on a way from here."""
        if not self.driven:
            return None
        chosen = tried(positions) if dt is not None else stops(positions)
        for k, posture in self.postures:
            way = positions[:, k], orientations[:, k]
            found = posture.broken(*way, chosen, self.rules, margin, dt)
            if found:
                return found
        if len(self._positions) != 2:
            return None
        rows = np.concatenate([self.state.positions[None], positions[chosen]])
        turns = np.concatenate([self.state.orientations[None], orientations[chosen]])
        left, right = self._bodies(*self._all_ends(rows, turns))
        slack = distances(left, right) - self.rules.boundaries.keep_out
        return broken({"spacing": slack}, margin)

    def _bodies(
        self,
        positions: Float64[np.ndarray, "m ends 3"],
        orientations: Float64[np.ndarray, "m ends 4"],
    ) -> list[Spheres]:
        """All that belongs to each end along a way whose joints have just been judged."""
        postures = {self.driven[k]: posture for k, posture in self.postures}
        rows = []
        for end in range(positions.shape[1]):
            parts = [self.rules.body(end, positions[:, end], orientations[:, end])]
            parts += [postures[end].spheres()] if end in postures else []
            rows.append(Spheres.joined(parts))
        return rows

    def _broken(
        self,
        positions: Float64[np.ndarray, "m driven 3"],
        orientations: Float64[np.ndarray, "m driven 4"],
        margin: float = 0.0,
    ) -> tuple[Rule, float] | None:
        """The rule that a way from here breaks, and by how much [m]."""
        path = self._all_ends(
            np.concatenate([self.state.positions[None], positions]),
            np.concatenate([self.state.orientations[None], orientations]),
        )
        return broken(self.rules.slacks(*path), margin)

    def _all_ends(
        self,
        positions: Float64[np.ndarray, "m driven 3"],
        orientations: Float64[np.ndarray, "m driven 4"],
    ) -> tuple[Float64[np.ndarray, "m ends 3"], Float64[np.ndarray, "m ends 4"]]:
        """The poses of all ends when the driven ones are here."""
        count = len(positions)
        all_positions = np.repeat(self._positions[None], count, axis=0)
        all_orientations = np.repeat(self._orientations[None], count, axis=0)
        all_positions[:, self.driven] = positions
        all_orientations[:, self.driven] = orientations
        return all_positions, all_orientations


def _longest(vectors: Float64[np.ndarray, "n 3"]) -> float:
    return float(np.max(np.linalg.norm(vectors, axis=-1), initial=0.0))


def stops(positions: Float64[np.ndarray, "m driven 3"]) -> list[int]:
    """Which poses of a stop the joints are solved for: its ends, and between them where it is long.

    A stop is planned anew at every tick, so that a few of its poses are enough.
    """
    longest = float(np.max(np.linalg.norm(positions[-1] - positions[0], axis=-1)))
    count = 2 + int(longest / STRIDE)
    return np.unique(np.linspace(0, len(positions) - 1, count).round().astype(int)).tolist()
