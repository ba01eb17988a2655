"""Protocol of a state estimator: measured grips and observed nodes in, nodes of the rope out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from jaxtyping import Bool, Float64

from lariat.trajectory import MotionState

if TYPE_CHECKING:
    # The driver of an arm imports these protocols and needs no rod.
    from lariat.rod import Rod


@dataclass(frozen=True)
class EstimatorSetup:
    """Facts that hold for the life of an estimator."""

    rod: Rod
    """Model of the rope as the scenario describes it."""


@dataclass(frozen=True)
class NodeObservation:
    """Nodes of the rope as perception has seen them."""

    time: float
    """Time of the exposure, which is earlier than the present [s]."""
    nodes: Float64[np.ndarray, "n 3"]
    """Positions [m]."""
    sigma: Float64[np.ndarray, "n"]
    """Standard deviation of each position [m]."""
    observed: Bool[np.ndarray, "n"]
    """Nodes that were seen; the others are bridged."""


class StateEstimator(Protocol):
    """Estimator of the rope's nodes.

    Lariat keeps the orientations, the twist and the velocities, which nodes do not show, in its own
    rod, moved by the same grips; the estimate replaces the positions.
    """

    def __init__(self, setup: EstimatorSetup) -> None:
        """Create the estimator of one rope."""
        ...

    def reset(self, time: float, grips: MotionState, nodes: Float64[np.ndarray, "n 3"]) -> None:
        """Begin anew with a rope at rest.

        Args:
            time: Present time [s].
            grips: Measured motion of both grips.
            nodes: Nodes of the rod at rest between them [m].
        """
        ...

    def estimate(
        self, time: float, grips: MotionState, observation: NodeObservation | None
    ) -> Float64[np.ndarray, "n 3"]:
        """Return the present nodes of the rope [m].

        Called with every state of the arms (100 Hz and more), and with every observation.

        Args:
            time: Present time [s].
            grips: Measured motion of both grips.
            observation: Observation that has just arrived, if any.
        """
        ...
