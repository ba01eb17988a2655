"""Sections of control."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from lariat.configuration import Bounds, Extensible

CONTROL_METHODS = Extensible(("gauss_newton", "network", "actions"), "lariat.controllers")
"""Controllers: `lariat.protocols.Controller`."""
STATE_ESTIMATORS = Extensible(("rod",), "lariat.state_estimators")
"""State estimators: `lariat.protocols.StateEstimator`."""
PATH_PLANNERS = Extensible(("whole_path",), "lariat.path_planners")
"""Planners: `lariat.protocols.PathPlanner`."""


@dataclass(frozen=True)
class PaperControl:
    """Parameters of the paper: its rod (Table 1, `solver = "xpbd"`) and the settings of its MPC."""

    mass: Annotated[float, Bounds(1e-4, 100.0, "kg")] = 0.5
    """Mass m of each node."""
    inertia: Annotated[float, Bounds(1e-6, 10.0, "kg m^2")] = 0.05
    """Moment of inertia I of each edge."""
    linear_damping: Annotated[float, Bounds(0.0, 0.999)] = 0.1
    """Share xi_v of the velocity that is lost per second."""
    angular_damping: Annotated[float, Bounds(0.0, 0.999)] = 0.3
    """Share xi_omega of the angular velocity that is lost per second."""
    bending_compliance: Annotated[float, Bounds(0.0, 10.0, "m^2/N")] = 0.003
    """Compliance beta_b of an inner node: EI = l / (4 beta_b), edges of length l."""
    iterations: Annotated[int, Bounds(1, 1000)] = 20
    """Solver iterations J of Algorithm 1."""
    learning_rate: Annotated[float, Bounds(1e-6, 1.0)] = 1e-3
    """Learning rate of Adam on the network's weights."""
    optimizer_steps: Annotated[int, Bounds(1, 1000)] = 30
    """Optimiser steps I of Algorithm 2."""
    horizon: Annotated[int, Bounds(1, 100)] = 5
    """Horizon H in steps of `time_step`."""
    time_step: Annotated[float, Bounds(1e-3, 0.1, "s")] = 0.01
    """Time step of the prediction."""
    error_weight: float = 1.0
    """Weight omega_1 of the sum of node distances [1/m]."""
    obstacle_weight: float = 0.01
    """Weight omega_2 of the obstacle term [m^2]."""
    speed_weight: float = 0.5
    """Weight omega_3 of the squared speed [s^2/m^2]."""
    obstacle_distance: Annotated[float, Bounds(1e-3, 1.0, "m")] = 0.03
    """Distance epsilon_d of eq. (13); goals closer to an obstacle are not reached exactly."""


@dataclass(frozen=True)
class Control:
    """Model predictive control of the rope."""

    method: Annotated[str, CONTROL_METHODS] = "gauss_newton"
    """Controller; `network` and `actions` are the paper's."""
    state_estimator: Annotated[str, STATE_ESTIMATORS] = "rod"
    """Estimator of the rope's state."""
    path_planner: Annotated[str, PATH_PLANNERS] = "whole_path"
    """Planner of whole paths."""
    solver: Literal["direct", "xpbd"] = "direct"
    """Solver of the predicting rod; `xpbd` is the paper's, for `network` and `actions`."""
    planner: bool = True
    """Whether a planned path guides the controller."""
    planning_time: Annotated[float, Bounds(0.1, 600.0, "s")] = 30.0
    """Processor time of a plan after which no further search begins."""
    adapt: bool = False
    """Whether the rope's material is estimated during the run; with `xpbd` by eq. (15)."""
    clearance: Annotated[float, Bounds(0.0, 0.2, "m")] = 0.012
    """Desired distance of the rope's surface from obstacles that are no supports."""
    certain_clearance: Annotated[float, Bounds(-0.2, 0.2, "m")] | None = None
    """Clearance that a path of a rope that is known in part keeps with a probability of 99 %, or it
    is not followed: three slower ones with more room are asked for. By default that of no path is
    worked out; with a negative one it is stated, and any will do."""
    pace: Annotated[float, Bounds(0.1, 1.0)] = 1.0
    """Share of the usual limits that planned paths use."""
    horizon: Annotated[int, Bounds(1, 100)] = 5
    """Horizon in steps of `time_step`, for `gauss_newton`."""
    time_step: Annotated[float, Bounds(1e-3, 0.2, "s")] = 0.05
    """Time step of the prediction, for `gauss_newton`."""
    iterations: Annotated[int, Bounds(1, 50)] = 1
    """Gauss-Newton iterations per horizon."""
    speed_weight: Annotated[float, Bounds(0.0, 100.0, "s^2")] = 0.02
    """Weight of the squared velocity beside the path's, relative to squared node distance."""
    acceleration_weight: Annotated[float, Bounds(0.0, 100.0, "s^4")] = 2e-4
    """Weight of the squared rate of change of that velocity."""
    paper: PaperControl = PaperControl()
