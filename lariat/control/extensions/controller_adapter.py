"""Controller from outside, in the place of the horizon optimizer."""

from __future__ import annotations

from typing import Literal

import numpy as np
from jaxtyping import Bool, Float64

from lariat.control.mpc.collision_avoidance import AvoidanceSpecification
from lariat.control.mpc.horizon import HorizonPlan, HorizonProblem
from lariat.protocols import Controller, ControllerInput, ControllerSetup
from lariat.rod import Rod, RolloutSpec
from lariat.safety.motion_contract import SETPOINT_PERIOD
from lariat.scenario.extensions import Extension
from lariat.trajectory import MotionLimits

HOLD_STEPS = 5
"""Steps for which an answer holds before the setpoints come to rest, if no other one follows."""


class ControllerAdapter:
    """Optimizer whose plan is one constant velocity: that of a `lariat.protocols.Controller`."""

    step_count = HOLD_STEPS
    time_step = SETPOINT_PERIOD * 1e-9
    executed_step_count = 1
    interpolation: Literal["constant", "linear"] = "constant"

    def __init__(
        self,
        extension: Extension,
        rod: Rod,
        moves: Bool[np.ndarray, "2 6"],
        limits: MotionLimits,
        clearance: float,
        max_grip_distance: float,
    ) -> None:
        """Create the controller.

        Args:
            extension: Its name.
            rod: Model of the rope.
            moves: Free components of each grip's velocity.
            limits: Limits of the grips' motion.
            clearance: Distance that the rope should keep from obstacles [m].
            max_grip_distance: Largest distance between the grips [m].

        Raises:
            ConfigurationError: The class cannot be imported or is no controller.
        """
        self._extension, self._moves = extension, moves
        setup = ControllerSetup(
            rod, moves.copy(), limits, clearance, max_grip_distance, self.time_step
        )
        self._begun = False
        """Whether the controller has been reset since the path began."""
        self._controller: Controller = extension.create(("reset", "velocity"), setup)

    def reset(self) -> None:
        """Let the controller be reset before its next answer."""
        self._begun = False

    def shift(self, elapsed: float) -> None:
        """Do nothing: a controller of its own keeps its own state."""

    def plan(
        self, rod: Rod, problem: HorizonProblem, avoidance: AvoidanceSpecification
    ) -> HorizonPlan:
        path, task = problem.path[0], problem.task
        assert task is not None
        state = ControllerInput(
            task.time,
            problem.state.positions + problem.offset,
            problem.state,
            task.grips,
            task.goal.copy(),
            problem.reference[0].copy(),
            path.copy(),
            rod,
            avoidance.obstacles,
        )
        if not self._begun:
            with self._extension.guarded("reset"):
                self._controller.reset()
            self._begun = True
        with self._extension.guarded("velocity"):
            answer = self._controller.velocity(state)
        velocity = self._extension.checked("velocity", answer, (2, 6)) * self._moves
        relative = np.repeat((velocity - path)[None] * self._moves, self.step_count, axis=0)
        return HorizonPlan(
            relative.reshape(-1, 2, 2, 3), self._predicted(rod, problem, relative), {}, 1
        )

    def _predicted(
        self, rod: Rod, problem: HorizonProblem, relative: Float64[np.ndarray, "h 2 6"]
    ) -> Float64[np.ndarray, "h n 3"]:
        """Nodes of the rope while the velocity holds [m]."""
        spec = RolloutSpec(
            problem.state, problem.path + relative, self.time_step, obstacles=problem.supports
        )
        return rod.rollout(spec).positions + problem.offset
