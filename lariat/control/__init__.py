"""Control of a rope: state estimation, model predictive control, runs and their supervision.

`lariat.rope_controller.RopeController` puts them together for a scenario, with the methods that
`lariat.controllers` chooses; `RecedingHorizonController` is the controller alone.
"""

from __future__ import annotations

from lariat.control.estimation.rope_observation import RopeObservation
from lariat.control.estimation.state_estimator import StateEstimator
from lariat.control.mpc.receding_horizon import Command, RecedingHorizonController
from lariat.control.mpc.reference_trajectory import ReferenceTrajectory
from lariat.control.run.arm_condition import ArmCondition
from lariat.control.run.reasons import Reason
from lariat.control.run.requests import Request, RequestAction
from lariat.control.run.state_machine import RunState
from lariat.control.supervision.path_choice import PathOffer

__all__ = [
    "ArmCondition",
    "Command",
    "PathOffer",
    "Reason",
    "RecedingHorizonController",
    "ReferenceTrajectory",
    "Request",
    "RequestAction",
    "RopeObservation",
    "RunState",
    "StateEstimator",
]
