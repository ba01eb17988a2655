"""Receding-horizon control: one chunk of setpoints per call.

The command is the reference trajectory plus an offset. The reference uses a share of the grippers'
limits and the offset the rest, so their sum keeps the limits; the offset follows the velocities of
the horizon optimizer, jerk-limited. New setpoints take effect at a point of the setpoint stream a
little ahead of now, and at the arms by their lag later: the model is first rolled out to there,
along the motion already decided.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float64

from lariat.control.estimation.arm_lag import ArmLag, ArmLagSettings
from lariat.control.estimation.state_estimator import StateEstimator
from lariat.control.mpc.collision_avoidance import AvoidanceSpecification
from lariat.control.mpc.horizon import HorizonOptimizer, HorizonPlan, HorizonProblem, HorizonTask
from lariat.control.mpc.reference_trajectory import ReferenceTrajectory
from lariat.control.mpc.setpoint_stream import SetpointStream
from lariat.control.mpc.velocity_tracking import track
from lariat.geometry import poses
from lariat.rod import RodState
from lariat.safety.motion_contract import SETPOINT_PERIOD, STOP_LIMIT_SHARE
from lariat.scenario.sections import Limits
from lariat.trajectory import (
    NANOSECONDS,
    MotionLimits,
    MotionSequence,
    MotionState,
    SetpointChunk,
    mean_twists,
)

COMMIT_DELAY = 30_000_000
"""Time from the inputs to the first setpoint that may still change [ns].

It covers the controller's step, and one setpoint because the gateway's curve uses one in advance.
"""


@dataclass(frozen=True)
class Command:
    """Result of one control step."""

    chunk: SetpointChunk
    """Setpoints to publish."""
    plan: HorizonPlan
    """Solution of the horizon."""
    plan_start: int
    """Time at which the predicted horizon begins, when its setpoints reach the arms [ns]."""
    plan_step: int
    """Duration of its steps [ns]."""


class RecedingHorizonController:
    """Controller that follows a reference trajectory and brings the rope to the goal at its end."""

    def __init__(
        self,
        estimator: StateEstimator,
        optimizer: HorizonOptimizer,
        moves: Bool[np.ndarray, "2 6"],
        offset_limits: MotionLimits,
        limits: Limits,
        expected_lag: float = 0.0,
    ) -> None:
        """Create a controller that follows nothing yet.

        Args:
            estimator: State estimator of the rope.
            optimizer: Optimizer of the horizon.
            moves: Free components of each grip's velocity.
            offset_limits: Limits on the motion relative to the reference trajectory.
            limits: Limits of the grippers.
            expected_lag: Lag of the arms before they have moved [s].
        """
        self.estimator, self.optimizer = estimator, optimizer
        self.limits, self.offset_limits = limits, offset_limits
        self._rotates = bool(moves[:, 3:].any())
        self.reference: ReferenceTrajectory | None = None
        self.oriented = (False, False)
        """Whether the orientation of each grip is part of the goal."""
        self.counted: Bool[np.ndarray, "n"] | None = None
        """Nodes whose distances from the goal count at the end of a reference; None for all."""
        self._stream: SetpointStream | None = None
        self._arm_lag = ArmLag(ArmLagSettings(expected_lag=expected_lag))
        self._start_index = 0
        """Index in the stream of the reference's first point."""
        self._commit = 0
        """Index in the stream of the last point that is decided."""
        self._stepped: int | None = None

    @property
    def stream(self) -> SetpointStream | None:
        """Setpoint stream, while one is running."""
        return self._stream

    @property
    def resting(self) -> bool:
        """Whether the commanded motion has come to rest."""
        return self._stream is None or self._stream.resting_from(self._commit)

    @property
    def at_end(self) -> bool:
        """Whether the end of the reference trajectory has been passed."""
        return self.reference is not None and self._reference_index >= self.reference.end

    @property
    def remaining_nodes(self) -> Float64[np.ndarray, "t n 3"]:
        """Nodes along the rest of the reference trajectory [m]."""
        if self.reference is None:
            return np.zeros((0, self.estimator.rod.node_count, 3))
        return self.reference.nodes[min(max(self._reference_index, 0), self.reference.end) :]

    @property
    def _reference_index(self) -> int:
        """Index in the reference trajectory of the last decided point."""
        return self._commit - self._start_index

    def disengage(self) -> None:
        """Drop stream and reference; the gateway then decides where the arms stop."""
        self._stream, self.reference = None, None
        self.optimizer.reset()

    def follow(self, reference: ReferenceTrajectory, now: int) -> None:
        """Begin a reference trajectory where the commanded motion rests.

        Args:
            reference: Trajectory that begins at the present grips.
            now: Present time [ns].
        """
        if self._stream is None:
            stop_limits = self.limits.scaled(STOP_LIMIT_SHARE)
            here = MotionState.at_rest(*self.estimator.motion.grips)
            self._stream = SetpointStream(here, now, SETPOINT_PERIOD, stop_limits)
            self._arm_lag.restart()
            self._commit = self._stream.index_at(now + COMMIT_DELAY)
        self.reference = reference
        self._start_index = max(self._commit, self._stream.index_at(now + COMMIT_DELAY))
        self.optimizer.reset()

    def tracking_error(self) -> float:
        """Distance of the measured grips from the commanded ones [m]."""
        if self._stream is None:
            return 0.0
        commanded = self._stream.motion_at(self.estimator.time).positions
        return float(np.max(np.linalg.norm(self.estimator.motion.positions - commanded, axis=1)))

    def brake(self, now: int) -> SetpointChunk | None:
        """Stop as soon as the limits allow, then rest; None when no stream is running.

        Args:
            now: Present time [ns].
        """
        if self._stream is None:
            return None
        following, self.reference = self.reference is not None, None
        self._commit = max(self._commit, self._stream.index_at(now + COMMIT_DELAY))
        if following:
            return self._stream.extended(self._commit)
        return self._stream.continued(self._commit)

    def step(
        self, now: int, goal: Float64[np.ndarray, "n 3"], avoidance: AvoidanceSpecification
    ) -> Command:
        """Plan the next chunk along the reference trajectory.

        Args:
            now: Present time [ns].
            goal: Nodes of the goal [m].
            avoidance: Obstacles and clearances.

        Raises:
            ValueError: There is no reference trajectory.
        """
        stream, reference = self._stream, self.reference
        if stream is None or reference is None:
            raise ValueError("step needs a reference trajectory; call follow first")
        self._commit = max(self._commit, stream.index_at(now + COMMIT_DELAY))
        start = stream.time_of(self._commit)
        commanded = stream.motion(self._commit)
        index = self._reference_index
        referred = reference.motion(index)
        state, effective = self._predicted_state(stream, commanded, start)
        count = self.optimizer.step_count
        stride = self.optimizer.time_step / reference.dt
        if self._stepped is not None:
            self.optimizer.shift((now - self._stepped) * 1e-9)
        self._stepped = now
        rotation = np.zeros((2, 6))
        rotation[:, 3:] = mean_twists(referred, commanded, 1.0)[:, 1]
        oriented = np.zeros((2, 6), dtype=bool)
        oriented[:, 3:] = np.array(self.oriented)[:, None]
        problem = HorizonProblem(
            state,
            self.estimator.offset,
            reference.twists(index, stride, count),
            reference.shapes(index, stride, count, goal),
            commanded.twists - referred.twists,
            rotation,
            oriented,
            self.estimator.supports,
            self.counted if self.at_end else None,
            HorizonTask(effective * NANOSECONDS, commanded, goal),
        )
        plan = self.optimizer.plan(self.estimator.rod, problem, avoidance)
        motions = self._setpoints(reference, commanded, plan)
        plan_step = round(self.optimizer.time_step / NANOSECONDS)
        return Command(stream.extended(self._commit, motions), plan, effective, plan_step)

    def _predicted_state(
        self, stream: SetpointStream, commanded: MotionState, start: int
    ) -> tuple[RodState, int]:
        """State of the model when new setpoints take effect at the arms, and that time [ns].

        Args:
            stream: Setpoint stream.
            commanded: Last decided motion.
            start: Time of that motion [ns].
        """
        now = self.estimator.time
        self._arm_lag.observe(now, stream.motion_at(now), self.estimator.motion)
        # Measured, then moved by the setpoints that are decided and not executed yet.
        decided = mean_twists(self._arm_lag.executed(now), commanded, 1.0)
        still = np.zeros((2, 2, 3))
        effective = start + round(self._arm_lag.lag / NANOSECONDS)
        expected = self.estimator.motion.moved(decided, still, still)
        return self.estimator.predict(expected, effective), effective

    def _setpoints(
        self, reference: ReferenceTrajectory, commanded: MotionState, plan: HorizonPlan
    ) -> MotionSequence:
        """Setpoints: the reference trajectory plus an offset whose velocity follows the plan."""
        dt, step = reference.dt, self.optimizer.time_step
        index = self._reference_index
        referred = reference.motion(index)
        offset = mean_twists(referred, commanded, 1.0)
        velocity = commanded.twists - referred.twists
        acceleration = commanded.accelerations - referred.accelerations
        planned = np.concatenate([velocity[None], plan.velocities])
        count = round((len(planned) - 1) * step / dt)
        shares = _shares(len(planned), count, dt, step)
        targets = (shares @ planned.reshape(len(planned), -1)).reshape(-1, *velocity.shape)
        moved = track(offset, velocity, acceleration, targets, self.offset_limits, dt)
        along = reference.motions(index + 1, count)
        orientations = along.orientations
        if self._rotates:
            orientations = poses.turned(moved.displacements[:, :, 1], orientations)
        return MotionSequence(
            along.positions + moved.displacements[:, :, 0],
            orientations,
            along.twists + moved.velocities,
            along.accelerations + moved.accelerations,
        )


@lru_cache
def _shares(value_count: int, count: int, dt: float, step: float) -> Float64[np.ndarray, "t k"]:
    """Shares of values at the ends of k - 1 steps in those that are interpolated between them.

    Args:
        value_count: Number k of values.
        count: Number of interpolated values after the first one.
        dt: Time between interpolated values [s].
        step: Duration of a step [s].
    """
    at = np.minimum(np.arange(count + 1) * dt / step, value_count - 1.0)
    return np.maximum(1.0 - np.abs(at[:, None] - np.arange(value_count)), 0.0)
