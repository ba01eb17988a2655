"""Plant whose grips hold the rope elsewhere than the arms' poses say."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.scenario.sections import TrueGrip, TrueGrips
from lariat.simulation.plants.end_motion import EndMotion
from lariat.simulation.plants.plant import Plant


class TrueGripsPlant:
    """Plant behind grips with errors; it takes the poses that are believed."""

    def __init__(self, plant: Plant, grips: TrueGrips) -> None:
        """Wrap a plant.

        Args:
            plant: Plant that takes the true poses.
            grips: Errors of the grips.
        """
        self._plant = plant
        self._errors = tuple(_error(grip) for grip in (grips.left, grips.right))

    @property
    def tension(self) -> float:
        """Largest tension along the rope [N]."""
        return self._plant.tension

    @property
    def nodes(self) -> Float64[np.ndarray, "n 3"]:
        """Node positions, left end first [m]."""
        return self._plant.nodes

    def release(self, end: int) -> None:
        """Let the rope slip out of a grip; see `Plant.release`."""
        self._plant.release(end)

    def reset(
        self, left: Pose, right: Pose, guess: Float64[np.ndarray, "m 3"] | None = None
    ) -> None:
        """Put the rope at rest between two grips; see `Plant.reset`."""
        self._plant.reset(left @ self._errors[0], right @ self._errors[1], guess)

    def set_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Replace all obstacles; the rope keeps its state."""
        self._plant.set_obstacles(obstacles)

    def step(self, left: EndMotion, right: EndMotion, duration: float) -> None:
        """Move the grips to their new motion within `duration` [s], and the rope with them."""
        ends = (_held(end, error) for end, error in zip((left, right), self._errors, strict=True))
        self._plant.step(*ends, duration)


def _error(grip: TrueGrip) -> Pose:
    """T_believed_true of a grip."""
    return Pose(np.array(grip.offset), poses.exponential(np.radians(grip.rotation)))


def _held(end: EndMotion, error: Pose) -> EndMotion:
    """Motion of the true grip."""
    arm = poses.rotate(end.pose.orientation, error.position)
    return EndMotion(end.pose @ error, end.linear + np.cross(end.angular, arm), end.angular)
