"""Where a rod is, and what a roll-out of it answers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64

STRETCHED = 0.02
"""Change of length beyond which a rod that hardly stretches must be caught somewhere [-]."""


@dataclass(frozen=True)
class RodState:
    """Positions of n nodes and orientations of the n - 1 edges between them."""

    positions: Float64[np.ndarray, "n 3"]
    """[m]."""
    orientations: Float64[np.ndarray, "n-1 4"]
    """Of the edges, wxyz; the third axis lies along the edge, from left to right."""
    velocities: Float64[np.ndarray, "n 3"]
    """[m/s]."""
    angular_velocities: Float64[np.ndarray, "n-1 3"]
    """Of the edges, world frame [rad/s]."""

    def at_rest(self) -> RodState:
        """The same shape without motion."""
        return RodState(
            self.positions,
            self.orientations,
            np.zeros_like(self.velocities),
            np.zeros_like(self.angular_velocities),
        )


@dataclass(frozen=True)
class Rollout:
    """A rod over H steps."""

    positions: Float64[np.ndarray, "H n 3"]
    """After every step [m]."""
    orientations: Float64[np.ndarray, "H n-1 4"]
    """After every step, wxyz."""
    final: RodState
    """After the last step."""
    iterations: Int64[np.ndarray, "H"]
    """Factorisations spent on every step."""
    converged: Bool[np.ndarray, "H"]
    """Whether every step met the tolerance."""
    rest_length: float = np.nan
    """Of the whole rod [m]."""

    @property
    def trouble(self) -> str | None:
        """Why this roll-out is not to be believed, in one sentence; None where it is.

        A solver that gives up says so here and in `converged`, and leaves finite numbers behind: a
        controller goes on with its next horizon, which an exception would take from it.
        """
        if not np.all(self.converged):
            step = int(np.argmin(self.converged))
            return (
                f"step {step} of {len(self.converged)} did not converge in "
                f"{self.iterations[step]} factorisations; try more substeps or slower grips"
            )
        edges = np.diff(self.positions[-1], axis=0)
        stretch = np.linalg.norm(edges, axis=1).sum() / self.rest_length - 1.0
        if abs(stretch) > STRETCHED:
            return (
                f"the rod ends {100.0 * stretch:.1f} % off its length: its grips are too far "
                "apart, or an obstacle has caught it inside; start it clear of obstacles"
            )
        return None


@dataclass(frozen=True)
class StateDirections:
    """D changes of a `RodState`, each in units that its user chooses."""

    positions: Float64[np.ndarray, "D n 3"]
    """Those of nodes that a clamp places are without effect."""
    rotations: Float64[np.ndarray, "D n-1 3"]
    """Turns about the world axes."""
    velocities: Float64[np.ndarray, "D n 3"]
    angular_velocities: Float64[np.ndarray, "D n-1 3"]

    def checked(self, node_count: int) -> StateDirections:
        """Itself.

        Raises:
            ValueError: A field does not fit the rod or is not finite.
        """
        for name in ("positions", "rotations", "velocities", "angular_velocities"):
            value = np.asarray(getattr(self, name))
            rows = node_count - (name in ("rotations", "angular_velocities"))
            if value.shape != (len(self.positions), rows, 3) or not np.all(np.isfinite(value)):
                raise ValueError(
                    f"state_directions.{name} must be finite and ({len(self.positions)}, {rows}, "
                    f"3), got shape {value.shape}; this rod has {node_count} nodes"
                )
        return self


@dataclass(frozen=True)
class Linearization:
    """A roll-out with its forward sensitivities."""

    rollout: Rollout
    d_positions_d_actions: Float64[np.ndarray, "H n 3 K 2 6"]
    """Per block and end: linear [s], then angular velocity [m s]; no blocks where not asked for."""
    d_positions_d_parameters: Float64[np.ndarray, "H n 3 P"]
    """In the order in which the parameters were asked for; [m] per unit of each."""
    d_positions_d_state: Float64[np.ndarray, "H n 3 D"]
    """Along the state directions that were asked for."""


@dataclass(frozen=True)
class StateGradient:
    """Slope of a cost with respect to a `RodState`."""

    positions: Float64[np.ndarray, "n 3"]
    """Per metre; zero at nodes that a clamp places."""
    rotations: Float64[np.ndarray, "n-1 3"]
    """Per radian turned about the world axes."""
    velocities: Float64[np.ndarray, "n 3"]
    """Per m/s."""
    angular_velocities: Float64[np.ndarray, "n-1 3"]
    """Per rad/s."""


@dataclass(frozen=True)
class Gradient:
    """A roll-out with the gradient of a cost of its positions."""

    rollout: Rollout
    actions: Float64[np.ndarray, "K 2 6"]
    """Per m/s, then per rad/s."""
    state: StateGradient
    parameters: dict[str, float]
    """Per SI unit of each parameter."""


@dataclass(frozen=True)
class Rest:
    """A shape of equilibrium."""

    state: RodState
    converged: bool
    """Whether the search met the tolerance."""
    stable: bool
    """Whether the shape is a minimum of the energy: it returns when disturbed a little."""
    residual: float
    """How far the shape still moved when it was let go once more [m]."""
