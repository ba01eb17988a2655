"""State estimator: the rod moved by the measured grips, and its offset from the observed nodes.

The model is rolled out along the measured motion of the grips and never overwritten: node positions
show neither orientations nor twist nor velocities, and the model keeps its own. Observations
determine the offset of the observed nodes from the model's. It changes slowly where the model's
stiffness is wrong, so a filter with one variance per node follows it; predictions are the model's
plus the offset, and at rest they agree with the observations.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64

from lariat.control.estimation.grip_errors import GripErrors
from lariat.control.estimation.rope_observation import RopeObservation
from lariat.geometry import poses
from lariat.geometry.obstacles import chain_clearance
from lariat.rod import (
    DifferentiableRod,
    Rod,
    RodState,
    RolloutSpec,
    add_turns,
    count_turns_along,
    state_along,
)
from lariat.rod.obstacle_table import unpack
from lariat.trajectory import MotionState, mean_twists

SETTLING_DURATIONS = (10.0,)
"""Durations of the steps without inertia that bring the model to rest [s]."""
FALLING_DURATIONS = (10.0, 100.0, 1000.0)
"""Durations of the steps in which a rod that does not stay in its shape leaves it [s]."""

OTHER_TURNS = (0, -2, 2, -1, 1)
"""Turns beyond the model's that a rope in another shape may have, likeliest first [-]."""


@dataclass(frozen=True)
class EstimatorSettings:
    """Time steps and noise of the state estimator."""

    max_step: float = 0.0051
    """Longest step of the model [s]; longer implicit steps damp the rope's swinging."""
    max_prediction_step: float = 0.021
    """Longest step of a prediction [s]."""
    history_time: float = 0.5
    """Largest age of an observation [s]."""
    offset_drift: float = 2e-3
    """Growth of the offset's standard deviation [m/sqrt(s)]."""
    min_offset_time_constant: float = 0.12
    """Least time constant of the offset [s], so that swinging is not taken for an offset."""
    initial_offset_deviation: float = 0.03
    """Standard deviation of the offset before the first observation [m]."""
    max_equilibrium_mismatch: float = 0.35
    """Share of the model's distance from the observed nodes [-]; an equilibrium that is nearer to
    them than this share is taken for the rope's."""
    outlier_distance: float = 0.01
    """Least innovation of a node that reduces its gain as an outlier [m]."""
    outlier_deviations: float = 3.0
    """Innovation beyond that distance that reduces the gain, in standard deviations [-]."""
    max_drift_time: float = 10.0
    """Longest time between two observations for which the offset drifts [s]."""
    leaning_clearance: float = 1e-3
    """Distance between model and support below which it leans on it [m]."""
    diverged_offset: float = 0.08
    """Mean offset above which the model has another shape than the rope [m]."""


class StateEstimator:
    """Estimator of one rope's state."""

    def __init__(
        self,
        rod: DifferentiableRod,
        motion: MotionState,
        time: int,
        settings: EstimatorSettings | None = None,
    ) -> None:
        """Create an estimator of a rope at rest.

        Args:
            rod: Model of the rope.
            motion: Motion of the grips.
            time: Time of that motion [ns].
            settings: Time steps and noise.
        """
        self.settings = settings or EstimatorSettings()
        self.rod = rod
        self.grip_errors = GripErrors.none()
        """Errors of the grips with which the model is held."""
        self.supports: Float64[np.ndarray, "m 13"] | None = None
        """Obstacles that the rope may lean on, packed for the rod."""
        self.restart(motion, time)

    def restart(
        self,
        motion: MotionState,
        time: int,
        seen: Float64[np.ndarray, "n 3"] | None = None,
        turns: int = 0,
    ) -> None:
        """Restart the model at rest, without an offset.

        Args:
            motion: Motion of the grips that the arms report.
            time: Time of that motion [ns].
            seen: Observed nodes near which the rest shape lies, if any [m]; it keeps its set.
            turns: Whole turns of twist.

        Raises:
            ValueError: The rope does not reach from grip to grip.
        """
        guess, ends = None, self.grip_errors.held(motion)
        if seen is not None:
            guess = add_turns(state_along(seen, *ends.orientations), turns)
            guess = replace(guess, plastic_curvature=self.state.plastic_curvature)
        elif turns:
            guess = add_turns(self.rod.rest(*ends.grips, obstacles=self.supports).state, turns)
        self.state: RodState = self.rod.rest(
            *ends.grips, guess=guess, obstacles=self.supports
        ).state
        self.motion, self.time = motion, time
        self.start_time = time
        count = len(self.state.positions)
        self.offset: Float64[np.ndarray, "n 3"] = np.zeros((count, 3))
        self._variance = np.full(count, self.settings.initial_offset_deviation**2)
        self._observed_at: int | None = None
        self._history = deque([(time, self.state.positions)])
        self.innovation = 0.0
        """Mean distance of the last observation from its prediction [m]."""

    @property
    def nodes(self) -> Float64[np.ndarray, "n 3"]:
        """Present nodes of the rope: the model's plus the offset [m]."""
        return self.state.positions + self.offset

    @property
    def held_motion(self) -> MotionState:
        """Motion of the model's ends, which the grips hold with their errors."""
        return self.grip_errors.held(self.motion)

    @property
    def oldest(self) -> int:
        """Time up to which an observation can be compared with the model [ns]."""
        return self._history[0][0]

    @property
    def leaning(self) -> bool:
        """Whether the model leans on a support."""
        if self.supports is None:
            return False
        clearance = chain_clearance(
            self.state.positions, self.rod.properties.diameter / 2.0, unpack(self.supports)
        )
        return clearance < self.settings.leaning_clearance

    @property
    def turns(self) -> int:
        """Whole turns of twist in the rope; only the model has them, nodes do not show them."""
        return count_turns_along(self.state, self.nodes)

    def advance(self, motion: MotionState, time: int) -> None:
        """Move the model's ends to measured poses.

        Args:
            motion: Measured motion of the grips.
            time: Time of that motion [ns].
        """
        if time <= self.time:
            return
        dt = (time - self.time) * 1e-9
        steps = max(1, int(np.ceil(dt / self.settings.max_step)))
        ends = self.grip_errors.held(motion)
        self.state = self._rollout(self.state, mean_twists(self.held_motion, ends, dt), dt, steps)
        self.motion, self.time = motion, time
        self._history.append((time, self.state.positions))
        while (time - self._history[0][0]) * 1e-9 > self.settings.history_time:
            self._history.popleft()

    def predict(self, motion: MotionState, time: int) -> RodState:
        """Predict the model at a later time; the estimate is unchanged.

        Args:
            motion: Expected motion of the grips.
            time: Time of that motion [ns].
        """
        dt = (time - self.time) * 1e-9
        if dt <= 0.0:
            return self.state
        steps = max(1, int(np.ceil(dt / self.settings.max_prediction_step)))
        ends = self.grip_errors.held(motion)
        return self._rollout(self.state, mean_twists(self.held_motion, ends, dt), dt, steps)

    def change_material(
        self,
        rod: DifferentiableRod,
        change: Float64[np.ndarray, "n 3"],
        grip_errors: GripErrors | None = None,
    ) -> None:
        """Continue with another material, and with other errors of the grips.

        The model is carried over to the shape that the new material has, with its motion: it would
        swing there if it were left in the old one. The offset compensates for the change, so that
        the estimated nodes stay where they are. Its variance grows by the change and no more,
        because noise comes in with it.

        Args:
            rod: Rod with the new material.
            change: Expected change of the model's shape [m].
            grip_errors: Errors of the grips; by default those that were known.
        """
        before, ends = self.rod, self.held_motion
        self.rod, self.grip_errors = rod, grip_errors or self.grip_errors
        self._variance = self._variance + np.mean(change**2, axis=1)
        if isinstance(before, Rod) and isinstance(rod, Rod):
            old, _ = self._settled(before, ends, ends)
            new, _ = self._settled(rod, ends, self.held_motion)
            self._carry_over(old, new)

    def change_set(self, change: Float64[np.ndarray, "b l 3"] | float) -> None:
        """Continue with another set, whose shape the model is carried over to.

        Args:
            change: What the layers of the bends keep more than before [1/m].
        """
        kept = self.state.plastic_curvature
        if kept is None or not np.any(change):
            return
        assert isinstance(self.rod, Rod)
        ends = self.held_motion
        old, _ = self._settled(self.rod, ends, ends)
        self.state = replace(self.state, plastic_curvature=kept + change)
        new, _ = self._settled(self.rod, ends, ends)
        self._carry_over(old, new)

    def shape_change(
        self, rod: DifferentiableRod, grip_errors: GripErrors
    ) -> Float64[np.ndarray, "n 3"] | None:
        """Return the change of the model's rest shape with another material and other grips [m].

        Args:
            rod: Rod with the other material.
            grip_errors: Errors of the grips.

        Returns:
            The change; None where the rod would not stay in its new shape.
        """
        ends = self.held_motion
        # Only the rod's material is learned by shapes at rest.
        assert isinstance(self.rod, Rod)
        assert isinstance(rod, Rod)
        before, _ = self._settled(self.rod, ends, ends)
        target = grip_errors.held(self.motion)
        after, stable = self._settled(rod, ends, target, FALLING_DURATIONS)
        return after.positions - before.positions if stable else None

    def _settled(
        self,
        rod: Rod,
        present: MotionState,
        target: MotionState,
        steps: tuple[float, ...] = SETTLING_DURATIONS,
    ) -> tuple[RodState, bool]:
        """Shape of a rod after long steps without inertia, and whether it is stable.

        Args:
            rod: The rod.
            present: Present motion of the model's ends.
            target: Motion of its ends with the poses to bring them to.
            steps: Durations of the steps [s].
        """
        durations = np.array(steps)
        actions = np.zeros((len(durations), 2, 6))
        actions[0] = mean_twists(present, target, durations[0]).reshape(2, 6)
        settled, stable = rod.settle(self.state, actions, durations, self.supports)
        return settled.final, stable

    def _carry_over(self, before: RodState, after: RodState) -> None:
        """Change the model by the difference of two shapes."""
        moved = after.positions - before.positions
        turned = poses.multiply(after.orientations, poses.conjugate(before.orientations))
        state = self.state
        self.state = replace(
            state,
            positions=state.positions + moved,
            orientations=poses.normalized(poses.multiply(turned, state.orientations)),
        )
        self.offset = self.offset - moved
        self.offset[[0, -1]] = 0.0
        self._history = deque((time, nodes + moved) for time, nodes in self._history)

    def rest_with_material(
        self, rod: DifferentiableRod, grip_errors: GripErrors | None = None
    ) -> None:
        """Continue with another material in its rest shape, where the rope stands still.

        The offset compensates for the change, so that the estimated nodes stay where they are.

        Args:
            rod: Rod with the new material.
            grip_errors: Errors of the grips; by default those that were known.
        """
        self.rod, self.grip_errors = rod, grip_errors or self.grip_errors
        before = self.state.positions
        self.state = rod.rest(
            *self.held_motion.grips, guess=self.state.at_rest(), obstacles=self.supports
        ).state
        self.offset = self.offset + before - self.state.positions
        self.offset[[0, -1]] = 0.0
        self._history = deque([(self.time, self.state.positions)])

    def switch_equilibrium(
        self, nodes: Float64[np.ndarray, "n 3"], observed: Bool[np.ndarray, "n"]
    ) -> bool:
        """Restart in another equilibrium between the same grips, if the rope is seen in one.

        A rope with several equilibria does not always snap from one to the other with the model.
        Its turns are the model's, or else the first others with which it rests where it is seen.

        Args:
            nodes: Observed nodes [m].
            observed: Nodes that were seen, not bridged.

        Returns:
            Whether the equilibrium has been switched.
        """
        seen = np.where(observed[:, None], nodes, self.nodes)
        ends = self.held_motion

        def farthest(state: RodState) -> float:
            return float(np.max(np.linalg.norm(nodes - state.positions, axis=1)[observed]))

        turns = count_turns_along(self.state, seen)
        limit = self.settings.max_equilibrium_mismatch * farthest(self.state)
        for more in OTHER_TURNS:
            guess = add_turns(state_along(seen, *ends.orientations), turns + more)
            guess = replace(guess, plastic_curvature=self.state.plastic_curvature)
            try:
                rest = self.rod.rest(*ends.grips, guess=guess, obstacles=self.supports)
            except ValueError:
                # A taut rope has no other equilibrium.
                return False
            if rest.converged and farthest(rest.state) <= limit:
                self.restart(self.motion, self.time, seen, turns + more)
                return True
        return False

    def _rollout(
        self, state: RodState, twist: Float64[np.ndarray, "2 2 3"], dt: float, steps: int
    ) -> RodState:
        """State after `dt` [s] with constant twists of the grips."""
        action = twist.reshape(1, 2, 6)
        return self.rod.rollout(
            RolloutSpec(state, action, dt / steps, steps=steps, obstacles=self.supports)
        ).final

    def observe(self, rope: RopeObservation) -> None:
        """Update the offset from an observation."""
        settings, observed = self.settings, rope.observed
        error = rope.nodes - self.model_nodes_at(rope.stamp)
        if np.any(observed):
            self.innovation = float(np.mean(np.linalg.norm(error - self.offset, axis=1)[observed]))
        elapsed = 1.0 if self._observed_at is None else (rope.stamp - self._observed_at) * 1e-9
        if elapsed <= 0.0:
            return
        self._variance += settings.offset_drift**2 * min(elapsed, settings.max_drift_time)
        gain = self._variance / (self._variance + np.maximum(rope.sigma, 1e-6) ** 2)
        if self._observed_at is not None:
            gain = np.minimum(gain, 1.0 - np.exp(-elapsed / settings.min_offset_time_constant))
        # An outlier counts less.
        miss = np.linalg.norm(error - self.offset, axis=1)
        deviation = np.sqrt(self._variance + rope.sigma**2)
        typical = settings.outlier_distance + settings.outlier_deviations * deviation
        gain = gain * np.minimum(1.0, typical / np.maximum(miss, 1e-12))
        target = error if observed.all() else self._interpolated(error, observed)
        self.offset = self.offset + gain[:, None] * (target - self.offset)
        self._variance = np.where(observed, (1.0 - gain) * self._variance, self._variance)
        # The end nodes are where the grips are.
        self.offset[[0, -1]] = 0.0
        self._observed_at = rope.stamp

    @property
    def diverged(self) -> bool:
        """Whether the model has another shape than the rope."""
        return float(np.mean(np.linalg.norm(self.offset, axis=1))) > self.settings.diverged_offset

    def model_nodes_at(self, stamp: int) -> Float64[np.ndarray, "n 3"]:
        """Nodes of the model at an earlier time, interpolated in its history [m].

        Args:
            stamp: Time [ns].
        """
        before = after = self._history[0]
        for entry in self._history:
            before, after = after, entry
            if entry[0] >= stamp:
                break
        if after[0] <= stamp or after[0] == before[0]:
            return after[1]
        share = max(0.0, (stamp - before[0]) / (after[0] - before[0]))
        return (1.0 - share) * before[1] + share * after[1]

    def _interpolated(
        self, error: Float64[np.ndarray, "n 3"], observed: Bool[np.ndarray, "n"]
    ) -> Float64[np.ndarray, "n 3"]:
        """Offsets of all nodes: those of observed ones, between which and zero at the grips the
        others are interpolated [m]."""
        fixed = observed.copy()
        fixed[[0, -1]] = True
        values = np.where(observed[:, None], error, 0.0)
        values[[0, -1]] = 0.0
        (at,) = np.nonzero(fixed)
        index = np.arange(len(fixed))
        between = np.stack([np.interp(index, at, values[at, k]) for k in range(3)], axis=1)
        return np.where(observed[:, None], error, between)
