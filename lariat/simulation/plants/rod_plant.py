"""Plant that simulates the rope by Lariat's own rod, in finer steps than the controller's."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.geometry.obstacles import Obstacle, pack
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties, RodState, RolloutSpec
from lariat.rod.strains import tensions
from lariat.simulation.plants.end_motion import EndMotion, interpolate

MAX_ROD_STEP = 0.004
"""Longest implicit step of the rod [s]."""


class RodPlant:
    """Rod clamped at both ends."""

    def __init__(
        self,
        properties: RodProperties,
        node_count: int,
        obstacles: Sequence[Obstacle] = (),
        self_contact: bool = False,
        friction: float = 0.0,
    ) -> None:
        """Create a straight rod.

        Args:
            properties: Properties of the true rope.
            node_count: Number of nodes.
            obstacles: Obstacles that the rope can touch.
            self_contact: Whether strands of the rope touch each other.
            friction: Coefficient of friction of the rope on all obstacles [-].
        """
        self._friction = friction
        self._rod = Rod(properties, node_count, self_contact=self_contact)
        half = properties.length / 2.0
        self._state = self._rod.straight([-half, 0.0, 1.0], [half, 0.0, 1.0])
        self._ends = tuple(EndMotion(pose) for pose in self._grips())
        self.set_obstacles(obstacles)

    @property
    def nodes(self) -> Float64[np.ndarray, "n 3"]:
        """Node positions, left end first [m]."""
        return self._state.positions.copy()

    @property
    def tension(self) -> float:
        """Largest tension along the rope [N]."""
        return max(0.0, float(np.max(tensions(self._state.positions, self._rod.properties))))

    def release(self, end: int) -> None:
        """Refuse to let the rope slip out of a grip.

        Raises:
            ValueError: Both ends of the rod are clamped.
        """
        raise ValueError(f"the rod is clamped at end {end}; use plant.model = 'links'")

    def set_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Replace all obstacles; the rope keeps its state."""
        # The friction that obstacles bring along is that of the model of the rope.
        self._obstacles = pack([replace(o, friction=self._friction) for o in obstacles])

    def reset(
        self, left: Pose, right: Pose, guess: Float64[np.ndarray, "m 3"] | None = None
    ) -> None:
        """Put the rope at rest between two grips.

        Args:
            left: Pose of the left grip.
            right: Pose of the right grip.
            guess: Points along the rope, left end first [m]; the rope comes to rest near them
                where there are several rest shapes.

        Raises:
            ValueError: The grips are further apart than the rope is long.
        """
        start = None if guess is None else self._untwisted(guess, left)
        self._state = self._rod.rest(left, right, start, self._obstacles).state.at_rest()
        self._ends = (EndMotion(left), EndMotion(right))

    def step(self, left: EndMotion, right: EndMotion, duration: float) -> None:
        """Move the grips to their new motion within `duration` [s], and the rope with them."""
        goals = (left, right)
        if duration > 0.0:
            count = math.ceil(duration / MAX_ROD_STEP - 1e-9)
            dt = duration / count
            path = interpolate(self._ends, goals, duration, dt * np.arange(1, count + 1))
            # From the rod's own ends, so that rounding errors do not accumulate.
            x, q = self._state.positions[[0, -1], None], self._state.orientations[[0, -1], None]
            positions = np.concatenate([x, path[0]], axis=1)
            orientations = np.concatenate([q, path[1]], axis=1)
            turns = poses.multiply(orientations[:, 1:], poses.conjugate(orientations[:, :-1]))
            actions = np.empty((count, 2, 6))
            actions[:, :, :3] = np.swapaxes(np.diff(positions, axis=1), 0, 1) / dt
            actions[:, :, 3:] = np.swapaxes(poses.logarithm(turns), 0, 1) / dt
            spec = RolloutSpec(self._state, actions, dt, obstacles=self._obstacles)
            rollout = self._rod.rollout(spec)
            self._state = rollout.final
        self._ends = goals

    def _grips(self) -> tuple[Pose, Pose]:
        x, q = self._state.positions, self._state.orientations
        return Pose(x[0], q[0]), Pose(x[-1], q[-1])

    def _untwisted(self, nodes: Float64[np.ndarray, "m 3"], left: Pose) -> RodState:
        """State along given nodes, its frames parallel-transported from the left grip."""
        positions = polylines.resample(np.asarray(nodes, float), self._rod.node_count)
        frames = [left.orientation]
        for direction in poses.normalized(np.diff(positions, axis=0)):
            here = poses.rotate(frames[-1], np.array([0.0, 0.0, 1.0]))
            frames.append(poses.multiply(poses.rotation_between(here, direction), frames[-1]))
        # The right grip, which has no twist against the last edge either.
        frames.append(frames[-1])
        return RodState(
            positions, np.array(frames), np.zeros_like(positions), np.zeros((len(frames), 3))
        )
