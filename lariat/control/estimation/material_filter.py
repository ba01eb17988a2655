"""Kalman filter of the rope's material while it is moved, in place of eq. (15).

Rest shapes determine the ratio of bending stiffness to weight, the rest length, and, when they are
varied enough, rest curvature, the ratio of twisting to bending stiffness and a coarse profile of
the stiffness; swinging determines the damping. All of them are unknowns of one Kalman filter, whose
evidence is weighed as in `lariat.identification`: an unknown that the observed nodes do not
determine keeps its given value and standard deviation. The Jacobian is that of the rest shape
between the present grips; that of what only swinging shows comes from models with more of it.

One shape counts only once, however long it is observed: while the grips stand, its evidence is
computed again with every update, from the mean of the observations, until the rod fits (an iterated
filter). The evidence is kept when the grips go on to another shape.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float64

from lariat.control.estimation.adaptation import ParameterEstimate
from lariat.control.estimation.history_sensitivity import HistorySensitivity
from lariat.control.estimation.material_filter_settings import MaterialFilterSettings
from lariat.control.estimation.observation_mean import MAX_OBSERVATIONS, ObservationMean
from lariat.control.estimation.rope_observation import RopeObservation
from lariat.control.estimation.rope_unknowns import RopeUnknowns
from lariat.control.estimation.shape_evidence import (
    ErrorScale,
    ShapeObservation,
    whiten,
    with_own_value,
)
from lariat.control.estimation.state_estimator import StateEstimator
from lariat.geometry import poses
from lariat.identification import posterior
from lariat.rod import RodProperties
from lariat.rope_parameters import PUBLISHED, RopeParameter, Values
from lariat.trajectory import MotionState, mean_twists

ROTATION_LEVER_ARM = 0.05
"""Lever arm that converts a grip's rotation into a displacement [m]."""
MAX_HALVINGS = 5
"""Number of times that a step is halved before the material is left as it is."""


class MaterialFilter:
    """Adaptation of one rope's material by an iterated Kalman filter."""

    parameter_set: Literal["rod", "xpbd"] = "rod"
    informs_planner = True

    def __init__(
        self, properties: RodProperties, settings: MaterialFilterSettings | None = None
    ) -> None:
        """Create a filter without evidence.

        Args:
            properties: Given properties of the rope.
            settings: Periods, noise and thresholds.
        """
        self.settings = settings or MaterialFilterSettings()
        self._unknowns = RopeUnknowns.of(properties)
        self._centre = np.zeros(self._unknowns.count)
        self.properties = self._unknowns.properties(self._centre)
        """Properties of the rope as far as they are known."""
        self.grip_errors = self._unknowns.grip_errors(self._centre)
        """Errors of the grips as far as they are known."""
        self._prior = self._unknowns.prior_information(
            self._unknowns.per_unknown(lambda p: p.filter_prior.deviation)
        )
        self._past_evidence = np.zeros_like(self._prior)
        """Evidence of earlier shapes, linearized at `_centre`."""
        self._error_scale = ErrorScale(self.settings.error_scale_weight)
        self._shape_evidence = self._past_evidence
        """Evidence of the present shape."""
        self._x = self._centre
        self._applied = self._x
        self._limits = self._unknowns.per_unknown(lambda p: p.filter_prior.limit)
        self._free = self._limits > 0.0
        self._by_history = self._free & (
            self._unknowns.per_unknown(lambda p: float(p.follows_history)) > 0
        )
        """Unknowns that shapes show by how the rope came there."""
        self._history_sensitivity = HistorySensitivity(
            [name for name, at in self._unknowns.groups.items() if self._by_history[at].all()]
        )
        self._updated: int | None = None
        self._stated: Float64[np.ndarray, "P P"] | None = None
        """Covariance of the unknowns as of the last update; None until it is asked for."""
        self.settled = False
        """Whether the last update has hardly changed the rope."""
        self._converged = False
        self.standing = False
        """Whether grips and model rest, so that the model may be put into another shape."""
        self._shape_motion: MotionState | None = None
        self._previous_shape_motion: MotionState | None = None
        self._mean_motion: MotionState | None = None
        self._mean = ObservationMean()

    @property
    def bending_stiffness(self) -> float:
        """Bending stiffness EI, its mean along the rope [N m^2]."""
        return self.properties.bending_stiffness

    @property
    def standard_deviation(self) -> float:
        """Standard deviation of the bending stiffness [N m^2]."""
        return self.bending_stiffness * float(self._deviations()[self._index("bending_stiffness")])

    @property
    def scalars(self) -> Mapping[str, ParameterEstimate]:
        """Estimates of the parameters that have one value."""
        estimates = {p.name: self._estimates(p)[0] for p in PUBLISHED if p.values is Values.SCALAR}
        # A rope that springs back has no yield curvature.
        return {name: of for name, of in estimates.items() if math.isfinite(of.value)}

    @property
    def profiles(self) -> Mapping[str, Sequence[ParameterEstimate]]:
        """Estimates of the parameters that have several values, grip errors among them."""
        return {p.name: self._estimates(p) for p in PUBLISHED if p.values is not Values.SCALAR}

    def _estimates(self, parameter: RopeParameter) -> list[ParameterEstimate]:
        """Estimates of all values of a parameter; what is not unknown has no deviation."""
        name, at = parameter.name, self._unknowns.groups.get(parameter.name)
        if at is None:
            return [ParameterEstimate(value) for value in parameter.of(self.properties).tolist()]
        grips = parameter.values is Values.GRIPS
        values = self._applied[at] if grips else parameter.of(self.properties)
        known_below = self.settings.known_share * parameter.filter_prior.deviation
        return [
            ParameterEstimate(
                value,
                float(self._unknowns.change_per_unknown(name, value) * deviation),
                bool(0.0 < deviation < known_below),
            )
            for value, deviation in zip(values.tolist(), self._deviations()[at], strict=True)
        ]

    def _index(self, group: str) -> int:
        return self._unknowns.groups[group].start

    def update(
        self, estimator: StateEstimator, rope: RopeObservation
    ) -> Float64[np.ndarray, "n 3"] | None:
        """Take in an observation, as of `Adaptation`; the change [m] is that of the rest shape."""
        settings = self.settings
        self._history_sensitivity.follow(estimator)
        before = self._mean_motion
        if before is None or _displacement(before, estimator.motion) > settings.standing_distance:
            self._mean_motion = estimator.motion
            self._mean = ObservationMean()
        self._mean.add(rope.nodes, rope.sigma, rope.observed)
        speed = np.mean(np.linalg.norm(estimator.state.velocities, axis=1))
        self.standing = self._mean.count > 1 and bool(speed < settings.rest_speed)
        elapsed = settings.update_period if self._updated is None else rope.stamp - self._updated
        if elapsed < (settings.update_period_at_rest if self.standing else settings.update_period):
            return None
        self._updated, self._stated = rope.stamp, None
        used = self._mean.observed.copy()
        used[[0, -1]] = False
        if used.sum() < 5:
            return None
        self._keep_evidence(estimator.motion, 1e-9 * elapsed)
        # A shape at rest is observed until it tells no more.
        told = self._converged if self.standing else self.settled
        if told and self._shape_evidence.any():
            return None
        jacobian = self._jacobian(estimator, rope.stamp)
        error = self._mean.nodes - estimator.model_nodes_at(rope.stamp)
        node_speeds = np.linalg.norm(estimator.state.velocities, axis=1)
        noise = np.sqrt(self._mean.variance)
        # What is seen elsewhere than ever before may be wrong along the whole rope.
        miss = np.linalg.norm(error - estimator.offset, axis=1)
        excess = miss - settings.outlier_deviations * np.hypot(noise, settings.model_error)
        swing = settings.swinging_error_time * node_speeds
        swing = swing + settings.outlier_deviations * np.maximum(excess, 0.0)
        shape = whiten(
            ShapeObservation(
                # The model has the properties that were applied last.
                error - jacobian @ (self._x - self._applied),
                jacobian,
                noise,
                used,
                poses.normalized(np.gradient(estimator.state.positions, axis=0)),
                self._model_error(estimator),
                swing,
            ),
            self._error_scale.factor,
        )
        spread = settings.standing_spread if self.standing else settings.moving_spread
        seen = with_own_value(shape.evidence, self._index("bending_stiffness"), spread)
        prior = posterior.prior(self._x - self._centre, self._prior + self._past_evidence)
        dx = posterior.gauss_newton_step(seen + prior, self._free)
        (stiffness_step,) = np.abs(dx[self._unknowns.groups["bending_stiffness"]])
        dx = dx * min(1.0, settings.max_log_stiffness_step / max(stiffness_step, 1e-12))
        self._shape_evidence = seen.information
        if self.standing:
            self._error_scale.take(shape, dx, self._covariance())
        before, proposed = self._x, np.clip(self._x + dx, -self._limits, self._limits)
        self._x = self._accepted(estimator, jacobian, error, used, proposed)
        step = _rms(jacobian @ (self._x - before))
        self.settled = step < settings.settled_shape_change
        self._converged = (
            step < settings.converged_shape_change and self._mean.count >= MAX_OBSERVATIONS
        )
        change = jacobian @ (self._x - self._applied)
        if _rms(change) < settings.min_shape_change:
            return None
        self._history_sensitivity.reset()
        moved = self._x - self._applied
        changes = {
            name: float(moved[at][0])
            for name, at in self._unknowns.groups.items()
            if self._by_history[at].all()
        }
        estimator.change_set(self._history_sensitivity.set_change(changes))
        self._applied = self._x
        self.properties = self._unknowns.properties(self._x)
        self.grip_errors = self._unknowns.grip_errors(self._x)
        return change

    def _accepted(
        self,
        estimator: StateEstimator,
        jacobian: Float64[np.ndarray, "n 3 P"],
        error: Float64[np.ndarray, "n 3"],
        used: Bool[np.ndarray, "n"],
        proposed: Float64[np.ndarray, "P"],
    ) -> Float64[np.ndarray, "P"]:
        """Unknowns as near to wanted ones as the model can take without leaving the observed rope.

        A rope near a fold has other rest shapes beside its own. Where the model would move on to
        one of them, its residuals would say nothing about the material any more.

        Args:
            estimator: State estimator of the rope.
            jacobian: Derivative of the node positions with respect to the unknowns.
            error: Observed minus predicted nodes [m].
            used: Nodes that count.
            proposed: Unknowns after the full step.
        """
        settings, x = self.settings, proposed
        for _ in range(MAX_HALVINGS):
            if _rms(jacobian @ (x - self._applied)) < settings.min_shape_change:
                return x
            rod = estimator.rod.with_properties(self._unknowns.properties(x))  # pyright: ignore[reportAttributeAccessIssue]
            change = estimator.shape_change(rod, self._unknowns.grip_errors(x))
            if change is not None:
                left = _rms((error - change)[used])
                if left < _rms(error[used]) + settings.max_misfit_growth:
                    return x
            x = 0.5 * (self._applied + x)
        return self._applied

    def _keep_evidence(self, motion: MotionState, elapsed: float) -> None:
        """Keep the evidence of a shape once the grips have left it."""
        settings = self.settings
        self._past_evidence = self._past_evidence * math.exp(-elapsed / settings.memory_time)
        shape_motion = self._shape_motion
        if (
            shape_motion is None
            or _displacement(shape_motion, motion) > settings.same_shape_distance
        ):
            self._previous_shape_motion, self._shape_motion = self._shape_motion, motion
            self._past_evidence, self._shape_evidence = (
                self._past_evidence + settings.new_evidence_share * self._shape_evidence,
                np.zeros_like(self._past_evidence),
            )
            self._error_scale.keep()
            self._centre = self._x

    def _covariance(self) -> Float64[np.ndarray, "P P"]:
        """Covariance of the unknowns; zero where they are given."""
        free = np.ix_(self._free, self._free)
        covariance = np.zeros_like(self._prior)
        covariance[free] = np.linalg.inv(
            (self._prior + self._past_evidence + self._shape_evidence)[free]
        )
        return covariance

    @property
    def distribution(self) -> tuple[Float64[np.ndarray, "P"], Float64[np.ndarray, "P P"]]:
        """Means and covariance of the unknowns that the rope's properties have."""
        if self._stated is None:
            self._stated = self._covariance()
        return self._applied, self._stated

    def _deviations(self) -> Float64[np.ndarray, "P"]:
        """Standard deviations of the unknowns, as of the last update."""
        return np.sqrt(np.diag(self.distribution[1]))

    def _model_error(self, estimator: StateEstimator) -> float:
        """Error of the model, noise apart; it is the same one in shapes that are alike [m]."""
        settings, before = self.settings, self._previous_shape_motion
        error = settings.leaning_error if estimator.leaning else settings.model_error
        if before is None:
            return error
        moved = _displacement(before, estimator.motion)
        return error / math.sqrt(min(1.0, moved / settings.independent_shape_distance))

    def _jacobian(self, estimator: StateEstimator, stamp: int) -> Float64[np.ndarray, "n 3 P"]:
        """Derivative of the node positions with respect to the unknowns [m]."""
        static = self._free & ~self._by_history
        jacobian = self._unknowns.shape_jacobian(estimator, self._applied, static)
        by_history = self._history_sensitivity.jacobian_at(stamp)
        if by_history is not None:
            jacobian[..., self._by_history] = by_history
        return jacobian


def _displacement(before: MotionState, after: MotionState) -> float:
    """Largest displacement of a grip between two states, rotations included [m]."""
    change = mean_twists(before, after, 1.0)
    return float(np.max(np.linalg.norm(change, axis=2) @ np.array([1.0, ROTATION_LEVER_ARM])))


def _rms(change: Float64[np.ndarray, "n 3"]) -> float:
    """Root mean square of the node displacements [m]."""
    return float(np.sqrt(np.mean(np.sum(change**2, axis=1))))
