"""Optimal control problem of one horizon, its solution, and the interface of its optimizers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from jaxtyping import Bool, Float64

from lariat.control.mpc.collision_avoidance import AvoidanceSpecification
from lariat.rod import RodState
from lariat.trajectory import MotionState
from lariat.trajectory.state import Vectors


@dataclass(frozen=True)
class HorizonTask:
    """Task that a horizon serves."""

    time: float
    """Time at which the horizon begins [s]."""
    grips: MotionState
    """Commanded motion of the grips at its beginning."""
    goal: Float64[np.ndarray, "n 3"]
    """Nodes of the goal [m]."""


@dataclass(frozen=True)
class HorizonProblem:
    """Problem of one horizon; arrays have one row for each of its steps."""

    state: RodState
    """State of the model when new setpoints take effect."""
    offset: Float64[np.ndarray, "n 3"]
    """Offset of the observed nodes from the model's [m]."""
    path: Float64[np.ndarray, "h 2 6"]
    """Mean velocities of the grips along the reference trajectory [m/s, rad/s]."""
    reference: Float64[np.ndarray, "h n 3"]
    """Reference nodes at the end of each step [m]."""
    velocity: Vectors
    """Present velocity of the grips relative to the reference trajectory [m/s, rad/s]."""
    rotation: Float64[np.ndarray, "2 6"]
    """Rotation of the grips from the reference trajectory [rad], in the angular components."""
    oriented: Bool[np.ndarray, "2 6"]
    """Components of that rotation that are zero at the goal."""
    supports: Float64[np.ndarray, "m 13"] | None = None
    """Obstacles that the rope may lean on, packed for the rod."""
    counted: Bool[np.ndarray, "n"] | None = None
    """Nodes whose distances from the reference count; None for all."""
    task: HorizonTask | None = None
    """Task, for controllers that do not follow the reference alone."""


@dataclass(frozen=True)
class HorizonPlan:
    """Solution of a horizon."""

    velocities: Float64[np.ndarray, "h 2 2 3"]
    """Velocities relative to the reference trajectory at the ends of the steps [m/s, rad/s]."""
    nodes: Float64[np.ndarray, "h n 3"]
    """Predicted nodes [m]."""
    cost: dict[str, float]
    """Cost by term [mm^2]."""
    iterations: int
    """Optimizer iterations."""


class HorizonOptimizer(Protocol):
    """Solver of successive horizons.

    Implementations: `mpc.gauss_newton.GaussNewton` (default), `paper.optimizer.PaperOptimizer`
    (eq. (12) and (13) by Adam on a network or on the velocities) and
    `extensions.controller_adapter.ControllerAdapter` (classes from outside).
    """

    @property
    def step_count(self) -> int:
        """Steps of a horizon."""
        ...

    @property
    def time_step(self) -> float:
        """Duration of a step [s]."""
        ...

    @property
    def executed_step_count(self) -> int:
        """Steps of a horizon that are executed before the next plan, in Algorithm 2."""
        ...

    @property
    def interpolation(self) -> Literal["constant", "linear"]:
        """Velocity within a step: constant, or linear between the velocities at its ends."""
        ...

    def reset(self) -> None:
        """Drop the warm start."""
        ...

    def shift(self, elapsed: float) -> None:
        """Shift the warm start in time [s]."""
        ...

    def plan(
        self, rod: Any, problem: HorizonProblem, avoidance: AvoidanceSpecification
    ) -> HorizonPlan:
        """Solve a horizon.

        Args:
            rod: Model of the rope that the optimizer supports.
            problem: State, reference and bounds of this horizon.
            avoidance: Obstacles and clearances.
        """
        ...
