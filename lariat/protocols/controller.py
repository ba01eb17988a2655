"""Protocol of a controller: the state of the rope in, velocities of the grips out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry.obstacles import Obstacle
from lariat.trajectory import MotionLimits, MotionState

if TYPE_CHECKING:
    # The driver of an arm imports these protocols and needs no rod.
    from lariat.rod import Rod, RodState


@dataclass(frozen=True)
class ControllerSetup:
    """Facts that hold for the life of a controller."""

    rod: Rod
    """Model of the rope as the scenario describes it."""
    moves: Bool[np.ndarray, "2 6"]
    """Mask of the components of each grip's velocity that can move: translation, then rotation."""
    limits: MotionLimits
    """Limits of the grips' motion."""
    clearance: float
    """Distance that the rope's surface should keep from obstacles [m]."""
    max_grip_distance: float
    """Largest permitted distance between the grips [m]."""
    period: float
    """Time between two calls [s]."""


@dataclass(frozen=True)
class ControllerInput:
    """State of rope and task at the time from which the answer holds."""

    time: float
    """That time [s]."""
    nodes: Float64[np.ndarray, "n 3"]
    """Estimated nodes of the rope [m]."""
    state: RodState
    """State of the model from which the rod is rolled out; its nodes lack the observed offset."""
    grips: MotionState
    """Commanded poses and velocities of both grips."""
    goal: Float64[np.ndarray, "n 3"]
    """Nodes of the goal [m]."""
    path_nodes: Float64[np.ndarray, "n 3"]
    """Nodes of the planned path at that time [m]; those of the goal once it has ended."""
    path_velocity: Float64[np.ndarray, "2 6"]
    """Velocity of the grips along the planned path [m/s, rad/s]; zero without one."""
    rod: Rod
    """Model of the rope with the material that has been learnt so far."""
    obstacles: tuple[Obstacle, ...]
    """Obstacles that the rope must not touch."""


class Controller(Protocol):
    """Control law that is evaluated at every step."""

    def __init__(self, setup: ControllerSetup) -> None:
        """Create the controller of one cell."""
        ...

    def reset(self) -> None:
        """Forget everything about the motion so far, before another path is followed."""
        ...

    def velocity(self, state: ControllerInput) -> Float64[np.ndarray, "2 6"]:
        """Return the wanted velocity of both grips [m/s, rad/s].

        The motion approaches it within the limits on acceleration and jerk. It is the whole
        velocity: a controller that follows the planned path adds its correction to
        `path_velocity`. Components that cannot move are ignored.

        Args:
            state: State of rope and task.
        """
        ...
