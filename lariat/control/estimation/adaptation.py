"""Interface of the adaptation of the rope's material, and its estimates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from jaxtyping import Float64

from lariat.control.estimation.grip_errors import GripErrors
from lariat.control.estimation.rope_observation import RopeObservation
from lariat.control.estimation.state_estimator import StateEstimator


@dataclass(frozen=True)
class ParameterEstimate:
    """Estimate of one number."""

    value: float
    """Value [SI]."""
    standard_deviation: float = 0.0
    """Standard deviation [SI]; 0 when the method gives none."""
    known: bool = False
    """Whether observations have determined it."""


class Adaptation(Protocol):
    """Estimator of the model's material, and of its grips, from observations of the rope.

    Implementations: `estimation.material_filter.MaterialFilter` (default) and
    `paper.adaptation.PaperAdaptation` (eq. (15)).
    """

    parameter_set: Literal["rod", "xpbd"]
    """Rod whose parameters are learnt: the continuous one or the paper's."""
    informs_planner: bool
    """Whether the planner's rod has the parameters that are learnt."""
    settled: bool
    """Whether the last update has hardly changed the shape of the model."""
    standing: bool
    """Whether grips and model rest, so that the model may be put into another rest shape."""

    @property
    def properties(self) -> Any:
        """Properties of the rod as far as they are known."""
        ...

    @property
    def grip_errors(self) -> GripErrors:
        """Errors of the grips as far as they are known."""
        ...

    @property
    def bending_stiffness(self) -> float:
        """Bending stiffness EI, its mean along the rope [N m^2]."""
        ...

    @property
    def scalars(self) -> Mapping[str, ParameterEstimate]:
        """Estimates by name, as in the message of the parameter set."""
        ...

    @property
    def profiles(self) -> Mapping[str, Sequence[ParameterEstimate]]:
        """Estimates that have several values along the rope, by name."""
        ...

    @property
    def distribution(self) -> tuple[Float64[np.ndarray, "P"], Float64[np.ndarray, "P P"]]:
        """Means and covariance of the unknowns of `RopeUnknowns`; empty where there are others."""
        ...

    def update(
        self, estimator: StateEstimator, rope: RopeObservation
    ) -> Float64[np.ndarray, "n 3"] | None:
        """Take in an observation; change of the model's shape [m] when its properties change.

        Args:
            estimator: State estimator whose model gets the properties.
            rope: The observation.
        """
        ...


def apply_material(
    estimator: StateEstimator,
    adaptation: Adaptation,
    change: Float64[np.ndarray, "n 3"],
    *,
    moving: bool,
    max_grip_share: float = 0.98,
) -> None:
    """Give a state estimator's model the properties and grip errors that were learnt.

    Args:
        estimator: State estimator of the rope.
        adaptation: Adaptation that has learnt the properties.
        change: Change of the model's shape with them [m].
        moving: Whether the arms follow a path.
        max_grip_share: Distance of the grips above which the model is not put into its rest shape,
            as a share of the rope's length [-].
    """
    rod = estimator.rod.with_properties(adaptation.properties)  # pyright: ignore[reportAttributeAccessIssue]
    errors = adaptation.grip_errors
    positions = errors.held(estimator.motion).positions
    distance = np.linalg.norm(positions[1] - positions[0])
    relaxed = distance < max_grip_share * rod.properties.length
    if adaptation.standing and not moving and relaxed:
        estimator.rest_with_material(rod, errors)
    else:
        estimator.change_material(rod, change, errors)
