"""Unknowns of a held rope as one vector: its material, and how the grips hold it.

The material comes first, in the order of `lariat.identification.Material`; the grip errors
follow, positions before rotations, left before right.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from lariat.control.estimation.grip_errors import GripErrors
from lariat.control.estimation.state_estimator import StateEstimator
from lariat.geometry import poses
from lariat.identification.material import Material
from lariat.rod import RodProperties, RolloutSpec

PRIOR_DEVIATIONS = {
    "stiffness": 1.5,
    "twist_ratio": 0.7,
    "damping": 0.7,
    "internal_damping": 1e-3,
    "length": 0.008,
    "stiffness_profile": 0.2,
    "density_profile": 1e-3,
    "rest_curvature": 0.5,
    "grip_offset": 2e-3,
    "grip_rotation": math.radians(1.5),
}
"""Standard deviations before the first observation: of logarithms [-], of curvature times length
[rad], of each component of the grip errors [m, rad]. Internal damping and an even density are taken
as given."""
MAX_CHANGES = {
    "stiffness": math.log(50.0),
    "twist_ratio": math.log(8.0),
    "damping": math.log(20.0),
    "internal_damping": 0.0,
    "length": 0.03,
    "stiffness_profile": math.log(4.0),
    "density_profile": 0.0,
    "rest_curvature": 3.0,
    "grip_offset": 0.01,
    "grip_rotation": math.radians(8.0),
}
"""Largest change of an unknown from its given value."""
PROFILE_KNOTS = 3
"""Knots of the stiffness profile."""
STATIC_DURATION = 2.0
"""Duration of a step that gives the Jacobian of the rest shape [s]."""
STATIC_STEPS = 3
"""Number of these steps; the grips are displaced in the first."""


@dataclass(frozen=True)
class RopeUnknowns:
    """Map from vectors of unknowns to ropes; the vector of zeros is the given rope."""

    material: Material
    """Map from its unknowns to the material."""

    @classmethod
    def of(cls, properties: RodProperties) -> RopeUnknowns:
        """Return the unknowns of a rope with given properties."""
        return cls(Material(properties, PROFILE_KNOTS, curvature_knots=1))

    @property
    def groups(self) -> dict[str, slice]:
        """Place of each group of unknowns in the vector."""
        first = self.material.count
        grips = {"grip_offset": slice(first, first + 6), "grip_rotation": slice(first + 6, None)}
        return {**self.material.groups, **grips}

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return self.material.count + 12

    def per_unknown(self, values: dict[str, float]) -> Float64[np.ndarray, "P"]:
        """Return a vector with one value for all unknowns of each group."""
        spread = np.zeros(self.count)
        for name, place in self.groups.items():
            spread[place] = values[name]
        return spread

    def prior_information(self) -> Float64[np.ndarray, "P P"]:
        """Return the inverse covariance of the unknowns before the first observation."""
        information = np.diag(1.0 / self.per_unknown(PRIOR_DEVIATIONS) ** 2)
        material = slice(0, self.material.count)
        information[material, material] = self.material.prior_information(PRIOR_DEVIATIONS)
        return information

    def properties(self, x: Float64[np.ndarray, "P"]) -> RodProperties:
        """Return the properties of the rope of a vector."""
        return self.material.properties(x[: self.material.count])

    def grip_errors(self, x: Float64[np.ndarray, "P"]) -> GripErrors:
        """Return the grip errors of a vector."""
        groups = self.groups
        return GripErrors(
            x[groups["grip_offset"]].reshape(2, 3), x[groups["grip_rotation"]].reshape(2, 3)
        )

    def shape_jacobian(
        self,
        estimator: StateEstimator,
        x: Float64[np.ndarray, "P"],
        free: Bool[np.ndarray, "P"],
    ) -> Float64[np.ndarray, "n 3 P"]:
        """Return the derivative of the rest shape with respect to the free unknowns [m].

        Args:
            estimator: State estimator of the rope.
            x: Unknowns.
            free: Unknowns to differentiate in; grip errors are always differentiated in.
        """
        properties, count = self.properties(x), self.material.count
        names, chain = self.material.parameter_jacobian(properties, free[:count])
        linear = estimator.rod.with_properties(properties).linearize(
            RolloutSpec(
                estimator.state.at_rest(),
                np.zeros((2, 2, 6)),
                STATIC_DURATION,
                steps=STATIC_STEPS,
                obstacles=estimator.supports,
            ),
            parameters=names,
        )
        jacobian = np.zeros((estimator.rod.node_count, 3, self.count))
        jacobian[..., :count] = linear.d_positions_d_parameters[-1] @ chain
        # Displacements in the world frame, per unit of the velocity in the first step.
        displaced = linear.d_positions_d_actions[-1][:, :, 0] / STATIC_DURATION
        frames = poses.matrix(estimator.motion.orientations)
        for name, part in (("grip_offset", slice(0, 3)), ("grip_rotation", slice(3, 6))):
            local = np.einsum("ncew,ewl->ncel", displaced[..., part], frames)
            jacobian[..., self.groups[name]] = local.reshape(*local.shape[:2], 6)
        return jacobian
