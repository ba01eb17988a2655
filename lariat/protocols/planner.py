"""Protocol of a path planner: rope and goal in, waypoints of both grips out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry.grips import Grips
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.trajectory import MotionLimits

if TYPE_CHECKING:
    # The driver of an arm imports these protocols and needs no rod.
    from lariat.rod import Rod, RodState


@dataclass(frozen=True)
class PlannerSetup:
    """Facts that hold for the life of a planner."""

    moves: Bool[np.ndarray, "2 6"]
    """Mask of the components of each grip's motion that can move: translation, then rotation."""
    limits: MotionLimits
    """Limits of the grips' motion."""
    workspace: Float64[np.ndarray, "2 3"]
    """Lowest and highest corner of the box in which the grips stay [m]."""
    max_grip_distance: float
    """Largest permitted distance between the grips [m]."""
    seed: int
    """Seed of random numbers."""


@dataclass(frozen=True)
class PlanningProblem:
    """Rope at rest, and the goal that it is to reach."""

    rod: Rod
    """Model of the rope with the material that has been learnt so far."""
    state: RodState
    """State of the rope at rest between the grips."""
    grips: tuple[Pose, Pose]
    """Present poses of the grips."""
    goal: Float64[np.ndarray, "n 3"]
    """Nodes of the goal [m]."""
    goal_grips: tuple[Pose, Pose]
    """Grips of the goal."""
    obstacles: tuple[Obstacle, ...]
    """Obstacles that the rope must not touch."""
    supports: tuple[Obstacle, ...]
    """Obstacles that the rope may lean on."""
    clearance: float
    """Distance to keep between the surfaces of rope and obstacles [m]."""
    tolerance: float
    """Mean node distance at which the goal is reached [m]."""


@dataclass(frozen=True)
class GripPath(Grips):
    """Waypoints of both grips, from their present poses to the last ones.

    Lariat passes them within the limits, from rest to rest, and checks the motion with the rod.
    """


class PathPlanner(Protocol):
    """Planner of whole paths."""

    def __init__(self, setup: PlannerSetup) -> None:
        """Create the planner of one cell."""
        ...

    def plan(self, problem: PlanningProblem) -> GripPath | None:
        """Return the path to a goal; None where none is found.

        Args:
            problem: Rope, goal and obstacles.
        """
        ...
