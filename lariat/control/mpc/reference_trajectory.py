"""Reference trajectory: a planned path, sampled in steps of the setpoints."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float64

from lariat.geometry.grips import Grips
from lariat.trajectory import MotionSequence, MotionState


@dataclass(frozen=True)
class ReferenceTrajectory(Grips):
    """Poses of both grips one setpoint apart, from rest to rest, and the rope along them."""

    dt: float
    """Time between points [s]."""
    nodes: Float64[np.ndarray, "k n 3"]
    """Nodes of the rope [m]."""
    reached: bool = True
    """Whether it ends at the goal."""
    reason: str = ""
    """Reason why it ends elsewhere, in words."""
    blocked: bool = False
    """Whether obstacles lie between its end and the goal."""
    _travelled: Float64[np.ndarray, "t+1 2 2 3"] = field(init=False, repr=False)
    _velocities: Float64[np.ndarray, "t 2 2 3"] = field(init=False, repr=False)
    _accelerations: Float64[np.ndarray, "t 2 2 3"] = field(init=False, repr=False)

    @property
    def end(self) -> int:
        """Index of the last point."""
        return len(self) - 1

    @classmethod
    def standing(
        cls, motion: MotionState, nodes: Float64[np.ndarray, "n 3"], dt: float
    ) -> ReferenceTrajectory:
        """Trajectory that stays where it is.

        Args:
            motion: Motion of the grips.
            nodes: Nodes of the rope [m].
            dt: Time between points [s].
        """
        twice = np.repeat(motion.positions[None], 2, axis=0)
        turned = np.repeat(motion.orientations[None], 2, axis=0)
        return cls(twice, turned, dt, np.repeat(nodes[None], 2, axis=0))

    def __post_init__(self) -> None:
        steps = self.steps().reshape(-1, 2, 2, 3)
        still = np.zeros((1, 2, 2, 3))
        rates = np.concatenate([still, steps / self.dt, still])
        travelled = np.cumsum(np.concatenate([steps, still]), axis=0)
        object.__setattr__(self, "_travelled", np.concatenate([still, travelled]))
        object.__setattr__(self, "_velocities", 0.5 * (rates[1:] + rates[:-1]))
        object.__setattr__(self, "_accelerations", np.diff(rates, axis=0) / self.dt)

    def motion(self, index: int) -> MotionState:
        """State of motion at a point, with derivatives by central differences.

        Args:
            index: Index of the point; clipped to the trajectory.
        """
        k = min(max(index, 0), self.end)
        return MotionState(
            self.positions[k], self.orientations[k], self._velocities[k], self._accelerations[k]
        )

    def motions(self, first: int, count: int) -> MotionSequence:
        """States of motion at successive points.

        Args:
            first: Index of the first point; clipped to the trajectory as all others are.
            count: Number of points.
        """
        k = np.minimum(np.maximum(np.arange(first, first + count), 0), self.end)
        return MotionSequence(
            self.positions[k], self.orientations[k], self._velocities[k], self._accelerations[k]
        )

    def twists(self, start: float, stride: float, count: int) -> Float64[np.ndarray, "h 2 6"]:
        """Mean twists of the grips in steps of a horizon [m/s, rad/s].

        Args:
            start: Index at which the horizon begins.
            stride: Points per step.
            count: Steps.
        """
        corners = np.clip(start + stride * np.arange(count + 1), 0.0, self.end)
        before = corners.astype(int)
        share = (corners - before)[:, None, None, None]
        done = self._travelled
        travelled = done[before] + share * (done[np.minimum(before + 1, self.end)] - done[before])
        return (np.diff(travelled, axis=0) / (stride * self.dt)).reshape(count, 2, 6)

    def shapes(
        self,
        start: float,
        stride: float,
        count: int,
        goal: Float64[np.ndarray, "n 3"],
    ) -> Float64[np.ndarray, "h n 3"]:
        """Nodes after each step of a horizon [m]: the goal once the trajectory has ended.

        A blocked trajectory keeps its last shape: towards a goal behind an obstacle, the rope would
        come to rest against the obstacle.

        Args:
            start: Index at which the horizon begins.
            stride: Points per step.
            count: Steps.
            goal: Nodes of the goal [m].
        """
        goal = self.nodes[-1] if self.blocked else goal
        shapes = np.empty((count, *goal.shape))
        for row, at in zip(shapes, start + stride * np.arange(1.0, count + 1.0), strict=True):
            if at >= self.end:
                row[:] = goal
                continue
            k = max(int(at), 0)
            share = max(at - k, 0.0)
            row[:] = (1.0 - share) * self.nodes[k] + share * self.nodes[k + 1]
        return shapes
