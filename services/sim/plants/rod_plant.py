"""The rope played by our own rod in fine steps: fast, and as good as the model that controls it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.geometry.obstacles import Obstacle, pack
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties, RodState
from services.sim.plants.plant import EndMotion, way

STEP = 0.004
"""Longest implicit step [s]; the controller's is several times longer."""


class RodPlant:
    """A clamped rod."""

    def __init__(
        self,
        properties: RodProperties,
        node_count: int,
        obstacles: Sequence[Obstacle] = (),
        self_contact: bool = False,
    ) -> None:
        self._rod = Rod(properties, node_count, self_contact=self_contact)
        half = properties.length / 2.0
        self._state = self._rod.straight([-half, 0.0, 1.0], [half, 0.0, 1.0])
        self._ends = tuple(EndMotion(pose) for pose in self._grips())
        self.set_obstacles(obstacles)

    @property
    def nodes(self) -> Float64[np.ndarray, "n 3"]:
        """Where the rope is now, left end first [m]."""
        return self._state.positions.copy()

    def set_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Replaces everything that the rope can touch; the rope keeps its state."""
        self._obstacles = pack(obstacles)

    def reset(
        self, left: Pose, right: Pose, guess: Float64[np.ndarray, "m 3"] | None = None
    ) -> None:
        """Puts the rope at rest between two grips, near `guess` where several rests exist.

        Raises:
            ValueError: The grips are further apart than the rope is long.
        """
        start = None if guess is None else self._untwisted(guess, left)
        self._state = self._rod.rest(left, right, start, self._obstacles).state.at_rest()
        self._ends = (EndMotion(left), EndMotion(right))

    def step(self, left: EndMotion, right: EndMotion, duration: float) -> None:
        """Moves the grips there within `duration` [s] and the rope with them."""
        goals = (left, right)
        if duration > 0.0:
            count = math.ceil(duration / STEP - 1e-9)
            dt = duration / count
            actions = np.empty((count, 2, 6))
            for end, (start, goal) in enumerate(zip(self._ends, goals, strict=True)):
                # From where the rod's end is, so that rounding never adds up.
                here = self._grips()[end]
                there = way(start, goal, duration, dt * np.arange(1, count + 1))
                positions = np.vstack([here.position, there[0]])
                orientations = np.vstack([here.orientation, there[1]])
                turns = poses.multiply(orientations[1:], poses.conjugate(orientations[:-1]))
                actions[:, end, :3] = np.diff(positions, axis=0) / dt
                actions[:, end, 3:] = poses.logarithm(turns) / dt
            rollout = self._rod.rollout(self._state, actions, dt, obstacles=self._obstacles)
            self._state = rollout.final
        self._ends = goals

    def _grips(self) -> tuple[Pose, Pose]:
        x, q = self._state.positions, self._state.orientations
        return Pose(x[0], q[0]), Pose(x[-1], q[-1])

    def _untwisted(self, nodes: Float64[np.ndarray, "m 3"], left: Pose) -> RodState:
        """A state along given nodes whose frames turn as little as they can from the left grip."""
        n = self._rod.node_count
        positions = polylines.resampled(np.asarray(nodes, float), n)
        along = poses.normalized(np.diff(positions, axis=0))
        frames = np.empty((n - 1, 4))
        frame = left.orientation
        for k, direction in enumerate(along):
            here = poses.rotate(frame, np.array([0.0, 0.0, 1.0]))
            frame = poses.multiply(poses.between(here, direction), frame)
            frames[k] = frame
        return RodState(positions, frames, np.zeros((n, 3)), np.zeros((n - 1, 3)))
