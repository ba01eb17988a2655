"""Interface that every differentiable rod offers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from lariat.rod.model import Dimensions, End
from lariat.rod.results import Gradient, Rest, Rollout
from lariat.rod.rollout_spec import CostGradient, RolloutSpec
from lariat.rod.state import RodState


class DifferentiableRod(Protocol):
    """Rod that rolls out, differentiates a cost of a roll-out, and finds equilibria.

    Satisfied by `lariat.rod.Rod` and `lariat.paper.xpbd.XpbdRod`.
    """

    @property
    def properties(self) -> Dimensions:
        """Material and dimensions."""
        ...

    @property
    def node_count(self) -> int:
        """Number of nodes."""
        ...

    @property
    def edge_length(self) -> float:
        """Rest length of an edge [m]."""
        ...

    @property
    def left(self) -> End:
        """Hold of the end at node 0."""
        ...

    @property
    def right(self) -> End:
        """Hold of the end at the last node."""
        ...

    def straight(self, left_point: Sequence[float], right_point: Sequence[float]) -> RodState:
        """Return the straight rod at rest from one point towards another [m]."""
        ...

    def rollout(self, spec: RolloutSpec[RodState]) -> Rollout:
        """Simulate the rod."""
        ...

    def gradient(
        self,
        spec: RolloutSpec[RodState],
        d_cost_d_positions: Float64[np.ndarray, "H n 3"] | CostGradient,
        parameters: tuple[str, ...] = ...,
    ) -> Gradient:
        """Simulate the rod and differentiate a cost of its positions."""
        ...

    def rest(
        self,
        left: Pose,
        right: Pose,
        guess: RodState | None = None,
        obstacles: Float64[np.ndarray, "m 13"] | None = None,
    ) -> Rest:
        """Find an equilibrium between two grips."""
        ...
