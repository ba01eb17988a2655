"""Gauss-Newton model predictive control: the default optimizer of the horizon.

The variables are velocities of the grips relative to the reference trajectory, at the ends of the
horizon's steps, linear in between and continuous with the present one, so that the solution is a
motion that the grips can make. Each call improves the solution of the call before, shifted in time
(real-time iteration).
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from jaxtyping import Bool, Float64

from lariat.control.mpc.collision_avoidance import AvoidanceSpecification, GripPrediction
from lariat.control.mpc.constraints import constrained_step, overstretch
from lariat.control.mpc.horizon import HorizonPlan, HorizonProblem
from lariat.control.mpc.motion_kernels import bounds_of, kernel, rows_of
from lariat.control.mpc.objective import (
    ObjectiveWeights,
    effort_terms,
    orientation_terms,
    rope_terms,
)
from lariat.rod import Rod, RolloutSpec
from lariat.trajectory import MotionLimits

LEVENBERG_DAMPING = 1e-4
"""Damping of the Hessian, relative to its diagonal [-]."""


class GaussNewton:
    """Horizon optimizer by Gauss-Newton steps through the rod's sensitivities."""

    executed_step_count = 1
    """Steps before the next plan: it plans again after the first one."""
    interpolation: Literal["constant", "linear"] = "linear"
    """Velocity within a step: linear between the velocities at its ends."""

    def __init__(
        self,
        moves: Bool[np.ndarray, "2 6"],
        step_count: int,
        time_step: float,
        iterations: int,
        weights: ObjectiveWeights,
        limits: MotionLimits,
    ) -> None:
        """Create an optimizer without a warm start.

        Args:
            moves: Free components of each grip's velocity.
            step_count: Steps of a horizon.
            time_step: Duration of a step [s].
            iterations: Linearizations per call.
            weights: Weights of effort against tracking.
            limits: Limits on the velocities and their rate of change.
        """
        self.moves, self.iterations = moves, iterations
        self.step_count, self.time_step = step_count, time_step
        self.weights, self.limits = weights, limits
        (self._free,) = np.nonzero(moves.ravel())
        # The mean velocity of a step is the average of its two ends.
        self._means = 0.5 * (np.eye(step_count) + np.eye(step_count, k=-1))
        free = len(self._free)
        self._mean_components = np.kron(self._means, np.eye(free))
        # Mean velocities at a displacement by one unit, with even velocities at the ends of steps.
        even = np.tile(np.eye(free), (step_count, 1)) / (step_count * time_step)
        self._even_means = self._mean_components @ even
        self._columns = (12 * np.arange(step_count)[:, None] + self._free).ravel()
        self._rotation_jacobian = self._turns()
        self.reset()

    def reset(self) -> None:
        """Drop the warm start."""
        self._velocities = np.zeros((self.step_count, 2, 6))

    def shift(self, elapsed: float) -> None:
        """Shift the warm start in time [s]."""
        times = self.time_step * np.arange(1, self.step_count + 1)
        at = np.minimum(times + elapsed, times[-1])
        after = np.searchsorted(times[1:-1], at, side="right") + 1
        slopes = np.diff(self._velocities, axis=0) / np.diff(times)[:, None, None]
        past = (at - times[after - 1])[:, None, None]
        moved = self._velocities[after - 1] + past * slopes[after - 1]
        self._velocities = np.where((at < times[-1])[:, None, None], moved, self._velocities[-1])

    def plan(
        self, rod: Rod, problem: HorizonProblem, avoidance: AvoidanceSpecification
    ) -> HorizonPlan:
        """Solve a horizon, as of `HorizonOptimizer`."""
        count, dt, free = self.step_count, self.time_step, self._free
        means = self._mean_components
        initial_velocity = problem.velocity.reshape(2, 6)
        begun = initial_velocity.ravel()[free]
        unit = np.where(free % 6 < 3, 1.0, rod.properties.length / (2.0 * np.pi))
        velocities = self._bounded(self._velocities, initial_velocity)
        nodes, cost = problem.reference, {}
        for _ in range(self.iterations):
            ends = np.concatenate([initial_velocity[None], velocities])
            actions = problem.path + 0.5 * (ends[1:] + ends[:-1])
            spec = RolloutSpec(problem.state, actions, dt, obstacles=problem.supports)
            linear = rod.linearize(spec)
            model = linear.rollout.positions
            # In the mean velocities; the products below, not this array, are carried on to those
            # at the ends of the steps.
            jacobian = linear.d_positions_d_actions
            jacobian = jacobian.reshape(*model.shape, -1).take(self._columns, axis=-1)
            unit = np.maximum(unit, self._node_response(jacobian))
            values, rows = overstretch(model, jacobian, avoidance, rod.properties.length)
            nodes = model + problem.offset
            last = model.shape[1] - 1
            grips = GripPrediction(
                model[:, ::last],
                linear.rollout.orientations[:, [0, -1]],
                jacobian[:, ::last],
                self._rotation_jacobian,
            )
            rope = rope_terms(
                nodes,
                grips,
                jacobian,
                problem.reference,
                avoidance,
                dt,
                self.weights.along,
                problem.counted,
            )
            free_velocities = velocities.reshape(count, 12)[:, free]
            effort = effort_terms(free_velocities, begun, unit, self.weights, dt)
            orientation = orientation_terms(
                free_velocities,
                self._means,
                problem.rotation.ravel()[free] + 0.5 * dt * begun,
                problem.oriented.ravel()[free],
                unit,
                dt,
            )
            hessian = means.T @ rope.hessian @ means + effort.hessian + orientation.hessian
            hessian.ravel()[:: len(hessian) + 1] *= 1.0 + LEVENBERG_DAMPING
            gradient = rope.gradient @ means + effort.gradient + orientation.gradient
            step = constrained_step(hessian, gradient, values, rows @ means)
            changed = velocities.copy()
            changed.reshape(count, 12)[:, free] += step.reshape(count, -1)
            changed = self._bounded(changed, initial_velocity)
            change = (changed - velocities).reshape(count, 12)[:, free]
            nodes = nodes + jacobian @ (means @ change.ravel())
            velocities, cost = changed, {**rope.cost, **effort.cost, **orientation.cost}
        self._velocities = velocities
        return HorizonPlan(velocities.reshape(count, 2, 2, 3), nodes, cost, self.iterations)

    def _turns(self) -> Float64[np.ndarray, "h 2 3 v"]:
        """Derivative of the grips' rotations, small within a horizon, in the mean velocities."""
        count = self.step_count
        travel = self.time_step * np.tri(count)
        turns = np.zeros((count, 2, 3, count, 2, 6))
        for end in range(2):
            for axis in range(3):
                turns[:, end, axis, :, end, 3 + axis] = travel
        return turns[..., self.moves].reshape(count, 2, 3, -1)

    def _node_response(self, jacobian: Float64[np.ndarray, "h n 3 v"]) -> Float64[np.ndarray, "m"]:
        """Node displacement at the horizon's end per unit of a grip's displacement [m].

        A rope that is about to snap through moves far for a small rotation of a grip; the effort of
        that rotation is then the effort of the motion.
        """
        count = jacobian.shape[1]
        moved = jacobian[-1].reshape(3 * count, -1) @ self._even_means
        return np.sqrt(np.einsum("am,am->m", moved, moved) / count)

    def _bounded(
        self,
        velocities: Float64[np.ndarray, "h 2 6"],
        initial_velocity: Float64[np.ndarray, "2 6"],
    ) -> Float64[np.ndarray, "h 2 6"]:
        """Velocities within the limits on speed and acceleration, one step after the other."""
        bounded = np.empty_like(velocities)
        arrays = rows_of(initial_velocity), rows_of(velocities), bounds_of(self.limits)
        kernel("bound_velocities")(*arrays, bounded.reshape(-1, 3), self.time_step)
        return bounded
