"""Motion of both grips under commanded velocities, within the limits of a scenario."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.scenario.sections import Limits
from lariat.simulation.plants.end_motion import EndMotion
from lariat.trajectory import clipped


@dataclass(frozen=True)
class GripMotion:
    """Poses and velocities of both grips."""

    positions: Float64[np.ndarray, "2 3"]
    """Positions of the left and the right grip [m]."""
    orientations: Float64[np.ndarray, "2 4"]
    """Orientations, wxyz."""
    velocities: Float64[np.ndarray, "2 2 3"]
    """Velocities of each grip: linear [m/s], then angular [rad/s]."""

    @staticmethod
    def at_rest(left: Pose, right: Pose) -> GripMotion:
        """Return grips that stand still."""
        return GripMotion(
            np.array([left.position, right.position]),
            np.array([left.orientation, right.orientation]),
            np.zeros((2, 2, 3)),
        )

    @property
    def ends(self) -> tuple[EndMotion, EndMotion]:
        """Motion of the left and of the right grip."""
        left, right = (
            EndMotion(Pose(position, orientation), velocity[0], velocity[1])
            for position, orientation, velocity in zip(
                self.positions, self.orientations, self.velocities, strict=True
            )
        )
        return left, right

    def after(
        self,
        command: Float64[np.ndarray, "2 2 3"],
        duration: float,
        limits: Limits,
        max_distance: float,
    ) -> GripMotion:
        """Return the motion after a step towards commanded velocities.

        Speed and acceleration are clipped to their limits; the grips stay in the workspace, and
        their distance between `limits.spacing` and `max_distance`.

        Args:
            command: Commanded velocities: linear [m/s], then angular [rad/s].
            duration: Duration of the step [s].
            limits: Limits of the grips.
            max_distance: Largest distance of the grips [m].
        """
        target = clipped(command, limits.speed_bounds)
        change = clipped(target - self.velocities, duration * limits.acceleration_bounds)
        velocities = self.velocities + change
        # The velocity changes evenly during the step.
        mean = 0.5 * (self.velocities + velocities)
        low, high = np.array(limits.workspace)
        free = self.positions + duration * mean[:, 0]
        positions = _apart(np.clip(free, low, high), limits.spacing, max_distance)
        stopped = np.abs(positions - free) > 1e-12
        velocities[:, 0] = np.where(
            stopped, (positions - self.positions) / duration, velocities[:, 0]
        )
        turned = poses.multiply(poses.exponential(duration * mean[:, 1]), self.orientations)
        return GripMotion(positions, poses.normalized(turned), velocities)


def _apart(
    positions: Float64[np.ndarray, "2 3"], low: float, high: float
) -> Float64[np.ndarray, "2 3"]:
    """Positions moved along their line until their distance lies between two bounds."""
    chord = positions[1] - positions[0]
    distance = max(float(np.linalg.norm(chord)), 1e-9)
    correction = 0.5 * (np.clip(distance, low, high) / distance - 1.0) * chord
    return positions + np.array([-correction, correction])
