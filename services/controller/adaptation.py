"""Learns the rope's stiffness while it is moved, eq. (15), and says how sure it is.

Seen shapes fix the ratio of bending stiffness to weight and nothing else of the material: mass and
stiffness scaled together leave every motion as it is, and damping shows only in swinging, which
paths avoid. So one number moves: the logarithm of the bending stiffness, by a Kalman filter on the
seen nodes. Its sensitivity is that of the rest shape between the present grips; the twisting
stiffness keeps its ratio.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Bool, Float64

from services.controller.state_estimate import StateEstimate
from shared.rod import RodProperties

EVERY = 400_000_000
"""Between updates [ns]: after one, the model needs time to come to its new shape."""
PRIOR = 1.5
"""Standard deviation of the logarithm before anything was seen: a factor of 4.5."""
FORGETTING = 0.05
"""Growth of that standard deviation [1/sqrt(s)]."""
MODEL_ERROR = 3e-4
"""Of the rod itself and of calibration, alike in neighbouring nodes [m]."""
TELLING = 6.0
"""Independent observations in one shape: neighbouring nodes err together."""
FACTOR = 50.0
"""Most that the stiffness may differ from what was given, either way."""
LONGEST = math.log(2.0)
"""Most change of the logarithm in one update."""
DEADBAND = 0.03
"""Changes of the logarithm below this are not worth disturbing the model for."""
SETTLING = 2.0
"""Duration of the steps over which the rest shape's sensitivity is taken [s]."""
SETTLING_STEPS = 3


class Adaptation:
    """Estimates one rope's bending stiffness."""

    def __init__(self, properties: RodProperties) -> None:
        self._given = properties
        self.properties = properties
        self._variance = PRIOR**2
        self._updated: int | None = None

    @property
    def bending_stiffness(self) -> float:
        """EI [N m^2]."""
        return self.properties.bending_stiffness

    @property
    def standard_deviation(self) -> float:
        """Of the bending stiffness [N m^2]."""
        return self.bending_stiffness * math.sqrt(self._variance)

    def look(
        self,
        estimate: StateEstimate,
        stamp: int,
        nodes: Float64[np.ndarray, "n 3"],
        sigma: Float64[np.ndarray, "n"],
        observed: Bool[np.ndarray, "n"],
    ) -> Float64[np.ndarray, "n 3"] | None:
        """Takes in an observation; how the rest shape changes with it [m], if it does.

        Args:
            estimate: Whose model shall become the rope's.
        """
        if self._updated is not None and stamp - self._updated < EVERY:
            return None
        elapsed = 0.0 if self._updated is None else (stamp - self._updated) * 1e-9
        self._updated = stamp
        self._variance = min(self._variance + FORGETTING**2 * elapsed, PRIOR**2)
        slope = self._slope(estimate)
        error = nodes - estimate.modelled_at(stamp)
        used = observed.copy()
        used[[0, 1, -2, -1]] = False
        if used.sum() < 5:
            return None
        noise = np.maximum(sigma, 0.0) ** 2 + MODEL_ERROR**2
        # A frame far off the story counts as one of a larger noise.
        miss = np.linalg.norm(error - estimate.offset, axis=1)
        noise = noise * np.maximum(1.0, miss**2 / (9.0 * noise))
        weight = used / noise * min(1.0, TELLING / used.sum())
        information = float(np.sum(weight * np.sum(slope**2, axis=1)))
        pull = float(np.sum(weight * np.sum(slope * error, axis=1)))
        step = self._variance * pull / (1.0 + self._variance * information)
        self._variance /= 1.0 + self._variance * information
        bound = math.log(FACTOR)
        now = math.log(self.bending_stiffness / self._given.bending_stiffness)
        step = min(max(step, -LONGEST), LONGEST)
        after = min(max(now + step, -bound), bound)
        if abs(after - now) < DEADBAND:
            return None
        ratio = self._given.bending_stiffness / self._given.twisting_stiffness
        stiffness = self._given.bending_stiffness * math.exp(after)
        self.properties = self._given.with_stiffness(stiffness, stiffness / ratio)
        return (after - now) * slope

    def _slope(self, estimate: StateEstimate) -> Float64[np.ndarray, "n 3"]:
        """Change of the rest shape with the logarithm of the stiffness [m]."""
        linear = estimate.rod.linearize(
            estimate.state.at_rest(),
            np.zeros((1, 2, 6)),
            SETTLING,
            steps=SETTLING_STEPS,
            block_of_step=np.zeros(SETTLING_STEPS, dtype=np.int64),
            parameters=("bending_stiffness", "twisting_stiffness"),
        )
        slopes = linear.d_positions_d_parameters[-1]
        properties = estimate.rod.properties
        return (
            slopes[..., 0] * properties.bending_stiffness
            + slopes[..., 1] * properties.twisting_stiffness
        )
