"""Interface of a plant: the simulated true rope, whose ends are moved and whose nodes are read.

A plant receives no setpoints, only the poses and velocities of the grips.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.simulation.plants.end_motion import EndMotion


class Plant(Protocol):
    """Rope with both ends held, among obstacles."""

    @property
    def nodes(self) -> Float64[np.ndarray, "n 3"]:
        """Node positions, left end first [m]."""
        ...

    @property
    def tension(self) -> float:
        """Largest tension along the rope [N]."""
        ...

    def reset(
        self, left: Pose, right: Pose, guess: Float64[np.ndarray, "m 3"] | None = None
    ) -> None:
        """Put the rope at rest between two grips.

        Args:
            left: Pose of the left grip.
            right: Pose of the right grip.
            guess: Points along the rope, left end first [m]; the rope comes to rest near them
                where there are several rest shapes.
        """
        ...

    def set_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Replace all obstacles; the rope keeps its state."""
        ...

    def release(self, end: int) -> None:
        """Let the rope slip out of a grip, until the next reset.

        Args:
            end: 0 for the left grip, 1 for the right one.

        Raises:
            ValueError: The rope of this plant cannot leave a grip.
        """
        ...

    def step(self, left: EndMotion, right: EndMotion, duration: float) -> None:
        """Move the grips to their new motion, and the rope with them.

        Args:
            left: Left grip at the end of the step.
            right: Right grip at the end of the step.
            duration: Duration of the step [s].
        """
        ...
