"""Specification of a roll-out: start, grip velocities, time grid, obstacles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from jaxtyping import Float64, Int64

from lariat.rod.state import RodState

State_co = TypeVar("State_co", bound="RodState | Sequence[RodState]", covariant=True)

CostGradient = Callable[[Float64[np.ndarray, "*B H n 3"]], Float64[np.ndarray, "*B H n 3"]]
"""Gradient of a cost with respect to the positions of a roll-out, from these positions [1/m]."""


@dataclass(frozen=True)
class RolloutSpec(Generic[State_co]):
    """Roll-out of one rod, or of a batch of rods in one launch.

    A batch is a sequence of B states with B rows of actions; everything else is common to the
    batch. A specification of one state yields one result, a batch yields a list.

    Step k takes `dt`, split into `substeps` equal implicit steps, and is driven by the actions of
    block `block_of_step[k]`, which hold for the whole step.
    """

    state: State_co
    """Initial state, or one for each rod of a batch."""
    actions: Float64[np.ndarray, "*B K 2 6"]
    """Grip velocities of K blocks for both ends (0 left, 1 right), world frame: linear [m/s], then
    angular [rad/s]. Actions of a free end, and angular ones of a pinned end, have no effect."""
    dt: float
    """Duration of a step [s]."""
    steps: int | None = None
    """Number of steps H; by default one for each block, or as `block_of_step` says. Steps beyond
    the last block are driven by the last block."""
    block_of_step: Int64[np.ndarray, "H"] | None = None
    """Block that drives each step, not decreasing; by default block k drives step k."""
    substeps: int = 1
    """Implicit steps per step."""
    obstacles: Float64[np.ndarray, "m 13"] | None = None
    """Obstacles from `lariat.geometry.pack`; None for an empty scene."""

    @property
    def is_batch(self) -> bool:
        """Whether this is a batch of rods."""
        return not isinstance(self.state, RodState)

    @property
    def states(self) -> Sequence[RodState]:
        """Initial states, one for each rod of the batch."""
        return (self.state,) if isinstance(self.state, RodState) else self.state

    @property
    def batched_actions(self) -> Float64[np.ndarray, "B K 2 6"]:
        """Actions with a leading batch axis, which is of length one for a single rod."""
        actions = np.asarray(self.actions, float)
        return actions[None] if isinstance(self.state, RodState) else actions
