"""Results of a rod: roll-out, forward sensitivities, gradient of a cost, equilibrium."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float64, Int64

from lariat.rod.state import RodState

MAX_STRETCH = 0.02
"""Relative change of length above which a roll-out is not trusted [-]."""


@dataclass(frozen=True)
class Rollout:
    """Motion of a rod over H steps."""

    positions: Float64[np.ndarray, "H n 3"]
    """Node positions after every step [m]."""
    orientations: Float64[np.ndarray, "H m 4"]
    """Orientations of the frames after every step, wxyz; see `RodState`."""
    final: RodState
    """State after the last step."""
    iterations: Int64[np.ndarray, "H"]
    """Matrix factorizations, or sweeps over the constraints, of every step."""
    converged: Bool[np.ndarray, "H"]
    """Whether each step met the tolerance."""
    rest_length: float = np.nan
    """Rest length of the rod [m]."""

    @property
    def failure(self) -> str | None:
        """Reason not to trust this roll-out, in one sentence; None if there is none.

        A solver that fails to converge reports it here and in `converged` and leaves finite numbers
        behind: a controller continues with its next horizon, which an exception would prevent.
        """
        if not np.all(self.converged):
            step = int(np.argmin(self.converged))
            return (
                f"step {step} of {len(self.converged)} did not converge in "
                f"{self.iterations[step]} factorizations; try more substeps or slower grips"
            )
        edges = np.diff(self.positions[-1], axis=0)
        stretch = np.linalg.norm(edges, axis=1).sum() / self.rest_length - 1.0
        if abs(stretch) > MAX_STRETCH:
            return (
                f"the rod's final length is {100.0 * stretch:+.1f} % off its rest length: its "
                "grips are too far apart, or it is caught inside an obstacle; start it clear of "
                "obstacles"
            )
        return None


@dataclass(frozen=True)
class Linearization:
    """Roll-out with its forward sensitivities."""

    rollout: Rollout
    """The roll-out itself."""
    d_positions_d_actions: Float64[np.ndarray, "H n 3 K 2 6"]
    """Jacobian with respect to the grip velocities: linear [s], then angular [m s/rad]. K is zero
    if it was not requested."""
    d_positions_d_parameters: Float64[np.ndarray, "H n 3 P"]
    """Jacobian with respect to the requested parameters, in their order [m per SI unit of each]."""
    d_positions_d_state: Float64[np.ndarray, "H n 3 D"]
    """Derivatives along the requested directions of the initial state [m per unit of each]."""


@dataclass(frozen=True)
class StateGradient:
    """Gradient of a cost with respect to a `RodState`, per unit of the cost."""

    positions: Float64[np.ndarray, "n 3"]
    """Gradient in node positions [1/m]."""
    rotations: Float64[np.ndarray, "m 3"]
    """Gradient in rotations of the frames about the world axes [1/rad]."""
    velocities: Float64[np.ndarray, "n 3"]
    """Gradient in node velocities [s/m]."""
    angular_velocities: Float64[np.ndarray, "m 3"]
    """Gradient in angular velocities of the frames [s/rad]."""
    slips: Float64[np.ndarray, "m e s 3"] | None = None
    """Gradient in the slips on the bodies of the roll-out [1/m]; None without friction."""
    plastic_curvature: Float64[np.ndarray, "m-1 l 3"] | None = None
    """Gradient in what layers of the bends keep [m]; None for a rod without layers."""


@dataclass(frozen=True)
class Gradient:
    """Roll-out with the gradient of a cost of its positions."""

    rollout: Rollout
    """The roll-out itself."""
    actions: Float64[np.ndarray, "K 2 6"]
    """Gradient in the grip velocities: linear [s/m], then angular [s/rad]."""
    parameters: dict[str, float]
    """Gradient in each requested parameter [1 / its SI unit]."""
    state_gradient: Callable[[], StateGradient]
    """Function that computes `state`."""

    @cached_property
    def state(self) -> StateGradient:
        """Gradient in the initial state; computed when it is first read."""
        return self.state_gradient()


@dataclass(frozen=True)
class Rest:
    """Shape in equilibrium."""

    state: RodState
    """The shape, without motion."""
    converged: bool
    """Whether the search met its tolerance."""
    stable: bool
    """Whether the shape is a minimum of the energy, to which the rod returns when disturbed."""
    residual: float
    """Largest displacement of a node in the last step of the search [m]."""
