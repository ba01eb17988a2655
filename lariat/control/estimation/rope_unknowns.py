"""Unknowns of a held rope as one vector: its material, and how the grips hold it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from lariat.control.estimation.grip_errors import GripErrors
from lariat.control.estimation.state_estimator import StateEstimator
from lariat.geometry import poses
from lariat.identification.material import Material
from lariat.rod import RodProperties, RolloutSpec
from lariat.rope_parameters import ROPE_PARAMETERS

PROFILE_KNOTS = 3
"""Knots of the stiffness profile."""
STATIC_DURATION = 2.0
"""Duration of a step that gives the Jacobian of the rest shape [s]."""
STATIC_STEPS = 3
"""Number of these steps; the grips are displaced in the first."""


@dataclass(frozen=True)
class RopeUnknowns(Material):
    """Map from vectors of unknowns to ropes; the vector of zeros is the given rope."""

    parameters = ROPE_PARAMETERS

    @classmethod
    def of(cls, properties: RodProperties) -> RopeUnknowns:
        """Return the unknowns of a rope with given properties."""
        return cls(properties, PROFILE_KNOTS, curvature_knots=1, touches=True)

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
        properties = self.properties(x)
        names, chain = self.parameter_jacobian(properties, free)
        linear = estimator.rod.with_properties(properties).linearize(  # pyright: ignore[reportAttributeAccessIssue]
            RolloutSpec(
                estimator.state.at_rest(),
                np.zeros((2, 2, 6)),
                STATIC_DURATION,
                steps=STATIC_STEPS,
                obstacles=estimator.supports,
            ),
            parameters=names,
        )
        jacobian = linear.d_positions_d_parameters[-1] @ chain
        # Displacements in the world frame, per unit of the velocity in the first step.
        displaced = linear.d_positions_d_actions[-1][:, :, 0] / STATIC_DURATION
        frames = poses.matrix(estimator.motion.orientations)
        for name, part in (("grip_offset", slice(0, 3)), ("grip_rotation", slice(3, 6))):
            local = np.einsum("ncew,ewl->ncel", displaced[..., part], frames)
            jacobian[..., self.groups[name]] = local.reshape(*local.shape[:2], 6)
        return jacobian
