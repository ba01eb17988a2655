"""The default way to use the horizon: Gauss-Newton on the grips' velocities through the rod.

The variables are velocities on top of the path's at the ends of the horizon's steps, linear in
between and continuous with the present one, so that what is asked is a motion the grips can make.
Each call improves the answer of the call before, moved on in time (real-time iteration).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from lariat.rod import Rod, RodState
from services.controller.mpc.constraints import overstretch, solved
from services.controller.mpc.motion import Bounds, Vectors, clipped
from services.controller.mpc.objective import (
    Surroundings,
    Weights,
    effort,
    least_squares,
    orientation,
)

DAMPING = 1e-4
"""Levenberg's, relative to the diagonal."""


@dataclass(frozen=True)
class Horizon:
    """What a plan is made for; arrays have one row for each step of the horizon."""

    state: RodState
    """Of the model when new setpoints take effect."""
    offset: Float64[np.ndarray, "n 3"]
    """Of the seen nodes from the modelled ones [m]."""
    path: Float64[np.ndarray, "h 2 6"]
    """Mean velocities of the grips along the path [m/s, rad/s]."""
    reference: Float64[np.ndarray, "h n 3"]
    """Nodes at the end of each step [m]."""
    velocity: Vectors
    """Of the grips on top of the path's, now."""
    turned: Float64[np.ndarray, "2 6"]
    """Rotation of the grips from their path [rad], in the places of the angular velocities."""
    oriented: Bool[np.ndarray, "2 6"]
    """Those of its components that the goal asks to vanish."""
    supports: Float64[np.ndarray, "m 12"] | None = None
    """What the rope leans on, packed for the rod."""


@dataclass(frozen=True)
class HorizonPlan:
    """Velocities to add to the path's, and what they lead to."""

    velocities: Float64[np.ndarray, "h 2 2 3"]
    """At the ends of the steps [m/s, rad/s]."""
    nodes: Float64[np.ndarray, "h n 3"]
    """Predicted [m]."""
    cost: dict[str, float]
    """By term [mm^2]."""
    iterations: int


class GaussNewton:
    """Plans one horizon after the other."""

    def __init__(
        self,
        moves: Bool[np.ndarray, "2 6"],
        horizon: int,
        dt: float,
        iterations: int,
        weights: Weights,
        bounds: Bounds,
    ) -> None:
        """
        Args:
            moves: Which components of each grip's velocity are free.
            horizon: Steps.
            dt: Of a step [s].
            iterations: Linearisations a call.
            bounds: On the velocities and their rate of change.
        """
        self.moves, self.horizon, self.dt, self.iterations = moves, horizon, dt, iterations
        self.weights, self.bounds = weights, bounds
        self.restart()

    def restart(self) -> None:
        """Forgets the call before."""
        self._velocities = np.zeros((self.horizon, 2, 6))

    def moved_on(self, elapsed: float) -> None:
        """Shifts the last answer in time [s]."""
        times = self.dt * np.arange(1, self.horizon + 1)
        flat = self._velocities.reshape(self.horizon, 12)
        shifted = [np.interp(times + elapsed, times, column) for column in flat.T]
        self._velocities = np.stack(shifted, axis=1).reshape(self.horizon, 2, 6)

    def plan(self, rod: Rod, horizon: Horizon, surroundings: Surroundings) -> HorizonPlan:
        """The velocities of this horizon."""
        # A mean velocity in a step is half of what it begins and half of what it ends with.
        means = 0.5 * (np.eye(self.horizon) + np.eye(self.horizon, k=-1))
        before = horizon.velocity.reshape(2, 6)
        unit = np.where(np.arange(6) < 3, 1.0, rod.properties.length / (2.0 * np.pi))
        units = np.tile(unit, (2, 1))[self.moves]
        velocities = self._bounded(self._velocities, before)
        count = int(self.moves.sum())
        nodes, cost = horizon.reference, {}
        for _ in range(self.iterations):
            actions = horizon.path + np.einsum("hk,kec->hec", means, velocities)
            actions[0] += 0.5 * before
            linear = rod.linearize(horizon.state, actions, self.dt, obstacles=horizon.supports)
            slopes = linear.d_positions_d_actions[..., self.moves]
            slopes = np.einsum("hnckm,kj->hncjm", slopes, means, optimize=True)
            felt = self._felt(slopes)
            units = np.maximum(units, felt)
            slopes = slopes.reshape(*slopes.shape[:3], self.horizon * count)
            values, rows = overstretch(linear.rollout.positions, slopes, surroundings)
            nodes = linear.rollout.positions + horizon.offset
            model = linear.rollout.positions
            rope = least_squares(nodes, model, slopes, horizon.reference, surroundings, self.dt)
            own = effort(
                velocities[:, self.moves], before[self.moves], units, self.weights, self.dt
            )
            turn = orientation(
                velocities[:, self.moves],
                means,
                horizon.turned[self.moves] + 0.5 * self.dt * before[self.moves],
                horizon.oriented[self.moves],
                units,
                self.dt,
            )
            hessian = rope.hessian + own.hessian + turn.hessian
            hessian[np.diag_indices_from(hessian)] *= 1.0 + DAMPING
            step = solved(hessian, rope.slope + own.slope + turn.slope, values, rows)
            changed = velocities.copy()
            changed[:, self.moves] += step.reshape(self.horizon, count)
            changed = self._bounded(changed, before)
            moved = (changed - velocities)[:, self.moves].ravel()
            nodes = nodes + slopes @ moved
            velocities, cost = changed, {**rope.cost, **own.cost, **turn.cost}
        self._velocities = velocities
        return HorizonPlan(velocities.reshape(self.horizon, 2, 2, 3), nodes, cost, self.iterations)

    def _felt(self, slopes: Float64[np.ndarray, "h n 3 h m"]) -> Float64[np.ndarray, "m"]:
        """How far the nodes move at the horizon's end for each unit of a grip's way [m].

        A rope near where it snaps over answers to a small turn of a grip by a large motion: there a
        turn is as much effort as the motion.
        """
        moved = slopes[-1].sum(axis=2) / (self.horizon * self.dt)
        return np.sqrt(np.mean(np.sum(moved**2, axis=1), axis=0))

    def _bounded(
        self, velocities: Float64[np.ndarray, "h 2 6"], before: Float64[np.ndarray, "2 6"]
    ) -> Float64[np.ndarray, "h 2 6"]:
        """Within the bounds on speed and acceleration, one step after the other."""
        bounded = np.empty_like(velocities)
        last = before.reshape(2, 2, 3)
        most = self.bounds.acceleration * self.dt
        for k, velocity in enumerate(velocities.reshape(-1, 2, 2, 3)):
            wanted = clipped(velocity, self.bounds.speed)
            change = wanted - last
            size = np.linalg.norm(change, axis=2, keepdims=True)
            last = last + change * np.minimum(1.0, most[None] / np.maximum(size, 1e-300))
            bounded[k] = last.reshape(2, 6)
        return bounded
