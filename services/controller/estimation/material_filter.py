"""Learns the rope's material while it is moved, eq. (15), and says how sure it is of each part.

Shapes at rest tell the ratio of bending stiffness to weight, the rest length, and, when they are
varied enough, rest curvature, the ratio of twisting to bending stiffness and a coarse profile of
the stiffness; swinging tells the damping. All of them are unknowns of one Kalman filter, whose
evidence is weighed as in `lariat.rod.identification`: what the seen nodes do not tell keeps the
value that was given, and its standard deviation. Slopes are those of the rest shape between the
present grips; that of the damping comes from a second model which is moved along, damped more.

One shape tells only once, however long it is looked at: while the grips stay, what it says is found
anew with every look, from the mean of what was seen, until the rod fits (an iterated filter). Then
nothing more is asked of it; what it said is kept when the grips go on to another shape.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float64

from lariat.rod import Rod, RodProperties, RodState, RolloutSpec
from lariat.rod.identification import posterior
from lariat.rod.identification.material import Material
from lariat.trajectory import MotionState, mean_twists
from services.controller.estimation.adaptation import ParameterEstimate
from services.controller.estimation.state_estimator import StateEstimator

EVERY = 400_000_000
"""Between updates [ns]: after one, the model needs time to come to its new shape."""
EVERY_AT_REST = 100_000_000
"""The same while the grips stand, where the model is put into its new shape at once [ns]."""
SPREADS = {
    "stiffness": 1.5,
    "twist_ratio": 0.7,
    "damping": 0.7,
    "internal_damping": 1e-3,
    "length": 0.005,
    "stiffness_profile": 0.2,
    "density_profile": 1e-3,
    "rest_curvature": 0.5,
}
"""Standard deviations before anything was seen: of logarithms, and of curvature over the whole
length [rad]. The material's own damping is taken as given, and so is an even weight."""
LIMITS = {
    "stiffness": math.log(50.0),
    "twist_ratio": math.log(8.0),
    "damping": math.log(20.0),
    "internal_damping": 0.0,
    "length": 0.02,
    "stiffness_profile": math.log(4.0),
    "density_profile": 0.0,
    "rest_curvature": 3.0,
}
"""Most that an unknown may move away from what was given."""
PROFILE_KNOTS = 3
MEMORY = 60.0
"""Time after which what was seen counts a third [s]: a rope can be changed by hand."""
MODEL_ERROR = 3e-4
"""Of the rod itself and of calibration, alike in neighbouring nodes and while nothing moves [m]."""
NEW_SHAPE = 0.04
"""Way of a grip after which that error is another one [m]."""
SAME_SHAPE = 0.01
"""Way of a grip below which the rope is looked at in one shape [m]."""
STANDING = 5e-4
"""Way of a grip below which it stands [m]."""
LEVER = 0.05
"""Way that a rotation of the grip counts for [m/rad]."""
QUIET = 0.02
"""Mean speed of the model's nodes below which it rests [m/s]."""
LOOKS = 30
"""Of which a mean is taken while the grips stand, at most."""
UNSETTLED = 0.05
"""Error of the model per speed of its nodes: its slopes are those of a rope at rest [s]."""
TELLING = 6.0
"""Independent observations in one shape: neighbouring nodes err together."""
LONGEST = math.log(2.0)
"""Most change of the stiffness' logarithm in one update."""
DEADBAND = 2e-4
"""Changes of the rest shape below this are not worth disturbing the model for [m]."""
SETTLED = 1e-3
"""Change of the rest shape in one update, below which the rope at hand is known [m]."""
KNOWN = 0.5
"""Share of the standard deviation that was believed, below which an unknown counts as known."""
SETTLING = 2.0
"""Duration of the steps over which the rest shape's slopes are taken [s]."""
SETTLING_STEPS = 3
SWUNG = 0.3
"""By which the second model's damping differs, as a logarithm [-]."""
SWING_STEP = 0.011
"""Longest of that model [s]."""
SWING_MEMORY = 0.5
"""How far back its difference is kept [s]."""


class MaterialFilter:
    """Estimates one rope's material."""

    parameter_set: Literal["rod", "xpbd"] = "rod"
    informs_planner = True

    def __init__(self, properties: RodProperties) -> None:
        self._material = Material(properties, PROFILE_KNOTS, curvature_knots=1)
        self.properties = self._material.properties(np.zeros(self._material.count))
        """The rope as far as it is known."""
        groups = self._material.groups
        self._believed = self._material.prior_information(SPREADS)
        self._seen = np.zeros_like(self._believed)
        """What earlier shapes have told, around `_centre`."""
        self._centre = np.zeros(self._material.count)
        self._shape = self._seen
        """What the present one tells."""
        self._x = self._centre
        self._applied = self._x
        self._limits = self._material.per_unknown(LIMITS)
        self._free = self._limits > 0.0
        self._free[groups["damping"]] = properties.damping > 0.0
        self._swing = _Swing()
        self._updated: int | None = None
        self.settled = False
        """Whether the last look has hardly changed the rope any more."""
        self.standing = False
        """Whether grips and model rest, so that the model may be put into another shape."""
        self._told: MotionState | None = None
        self._before: MotionState | None = None
        self._looked: MotionState | None = None
        self._mean = _Mean()

    @property
    def bending_stiffness(self) -> float:
        """EI [N m^2], its mean along the rope."""
        return self.properties.bending_stiffness

    @property
    def standard_deviation(self) -> float:
        """Of the bending stiffness [N m^2]."""
        return self.bending_stiffness * float(self._deviations()[self._at("stiffness")])

    @property
    def scalars(self) -> Mapping[str, ParameterEstimate]:
        """Estimates of bending stiffness, damping, length and twist ratio."""
        p = self.properties
        values = {
            "bending_stiffness": ("stiffness", p.bending_stiffness),
            "damping": ("damping", p.damping),
            "length": ("length", p.length),
            "twist_ratio": ("twist_ratio", p.twisting_stiffness / p.bending_stiffness),
        }
        deviations = self._deviations()
        return {
            name: self._estimate(group, 0, value, value, deviations)
            for name, (group, value) in values.items()
        }

    @property
    def profiles(self) -> Mapping[str, Sequence[ParameterEstimate]]:
        """Estimates of the stiffness profile and of the rest curvature."""
        deviations = self._deviations()
        profile = self.properties.stiffness_profile
        curvature = np.ravel(self.properties.rest_curvature).tolist()
        scale = 1.0 / self._material.mean.length
        return {
            "stiffness_profile": [
                self._estimate("stiffness_profile", k, value, value, deviations)
                for k, value in enumerate(np.ravel(profile).tolist())
            ],
            "rest_curvature": [
                self._estimate("rest_curvature", k, value, scale, deviations)
                for k, value in enumerate(curvature)
            ],
        }

    def _estimate(
        self,
        group: str,
        index: int,
        value: float,
        scale: float,
        deviations: Float64[np.ndarray, "P"],
    ) -> ParameterEstimate:
        """Estimate of one unknown of a group.

        Args:
            group: Group of unknowns.
            index: Index of the unknown in the group.
            value: Value of the parameter [SI].
            scale: Change of the parameter per change of the unknown.
            deviations: Standard deviations of all unknowns.
        """
        deviation = deviations[self._at(group) + index]
        known = bool(0.0 < deviation < KNOWN * SPREADS[group])
        return ParameterEstimate(value, float(scale * deviation), known)

    def _at(self, group: str) -> int:
        return self._material.groups[group].start

    def update(
        self,
        estimator: StateEstimator,
        stamp: int,
        nodes: Float64[np.ndarray, "n 3"],
        sigma: Float64[np.ndarray, "n"],
        observed: Bool[np.ndarray, "n"],
    ) -> Float64[np.ndarray, "n 3"] | None:
        """Takes in an observation; how the rest shape changes with it [m], if it does.

        Args:
            estimator: Whose model shall become the rope's.
        """
        if self._free[self._material.groups["damping"]].all():
            self._swing.follow(estimator)
        if self._looked is None or _way(self._looked, estimator.motion) > STANDING:
            self._looked = estimator.motion
            self._mean = _Mean()
        self._mean.add(nodes, sigma, observed)
        speed = np.mean(np.linalg.norm(estimator.state.velocities, axis=1))
        self.standing = self._mean.looks > 1 and bool(speed < QUIET)
        elapsed = EVERY if self._updated is None else stamp - self._updated
        if elapsed < (EVERY_AT_REST if self.standing else EVERY):
            return None
        self._updated = stamp
        used = self._mean.observed.copy()
        used[[0, 1, -2, -1]] = False
        if used.sum() < 5:
            return None
        self._keep(estimator.motion, 1e-9 * elapsed)
        if self.settled and self._shape.any():
            return None
        slopes = self._slopes(estimator, stamp)
        error = self._mean.nodes - estimator.model_nodes_at(stamp)
        swinging = UNSETTLED * np.linalg.norm(estimator.state.velocities, axis=1)
        model_error = self._model_error(estimator.motion)
        noise = np.sqrt(self._mean.variance + model_error**2 + swinging**2)
        # A frame far off the story counts as one of a larger noise.
        miss = np.linalg.norm(error - estimator.offset, axis=1)
        noise = noise * np.maximum(1.0, miss / (3.0 * noise))
        # The model stands where the last applied unknowns have put it.
        residuals = error - slopes @ (self._x - self._applied)
        counting = min(1.0, TELLING / used.sum())
        seen = posterior.evidence(residuals[used], slopes[used], noise[used], counting)
        known = posterior.prior(self._x - self._centre, self._believed + self._seen)
        dx = posterior.gauss_newton_step(seen + known, self._free)
        (leap,) = np.abs(dx[self._material.groups["stiffness"]])
        dx = dx * min(1.0, LONGEST / max(leap, 1e-12))
        self._shape = seen.information
        self._x = np.clip(self._x + dx, -self._limits, self._limits)
        self.settled = _size(slopes @ dx) < SETTLED
        change = slopes @ (self._x - self._applied)
        if _size(change) < DEADBAND:
            return None
        self._applied = self._x
        self.properties = self._material.properties(self._x)
        self._swing.restart()
        return change

    def _keep(self, motion: MotionState, elapsed: float) -> None:
        """Adds what a shape has told to what is known, once the grips have left it."""
        self._seen = self._seen * math.exp(-elapsed / MEMORY)
        if self._told is None or _way(self._told, motion) > SAME_SHAPE:
            self._before, self._told = self._told, motion
            self._seen, self._shape = self._seen + self._shape, np.zeros_like(self._seen)
            self._centre = self._x

    def _deviations(self) -> Float64[np.ndarray, "P"]:
        """Of the unknowns: logarithms, or curvature in radians over the length."""
        free = self._free
        inner = (self._believed + self._seen + self._shape)[np.ix_(free, free)]
        found = np.zeros(len(free))
        found[free] = np.sqrt(np.diag(np.linalg.inv(inner)))
        return found

    def _model_error(self, motion: MotionState) -> float:
        """Of the model beside noise: in shapes that are alike it is the same one [m]."""
        if self._before is None:
            return MODEL_ERROR
        return MODEL_ERROR / math.sqrt(min(1.0, _way(self._before, motion) / NEW_SHAPE))

    def _slopes(self, estimator: StateEstimator, stamp: int) -> Float64[np.ndarray, "n 3 P"]:
        """Change of what is seen with the unknowns [m]."""
        shape_tells = self._free.copy()
        shape_tells[self._material.groups["damping"]] = False
        rod = estimator.rod.with_properties(self.properties)
        names, chain = self._material.parameter_jacobian(self.properties, shape_tells)
        linear = rod.linearize(
            RolloutSpec(
                estimator.state.at_rest(),
                np.zeros((1, 2, 6)),
                SETTLING,
                steps=SETTLING_STEPS,
                obstacles=estimator.supports,
            ),
            parameters=names,
            with_actions=False,
        )
        slopes = linear.d_positions_d_parameters[-1] @ chain
        swinging = self._swing.slope_at(stamp)
        if swinging is not None:
            slopes[..., self._material.groups["damping"]] = swinging[..., None]
        return slopes


class _Mean:
    """Of the nodes that were seen since the grips stand; older looks fade."""

    def __init__(self) -> None:
        self.looks = 0
        self._weights: np.ndarray = np.zeros(0)

    def add(
        self,
        nodes: Float64[np.ndarray, "n 3"],
        sigma: Float64[np.ndarray, "n"],
        observed: Bool[np.ndarray, "n"],
    ) -> None:
        """Takes one look; nodes that were not seen count for nothing."""
        if not self.looks:
            self._weights = np.zeros(len(nodes))
            self.nodes, self._noise, self._spread = nodes, *np.zeros((2, len(nodes)))
        self.looks += 1
        self._weights = np.minimum(self._weights, LOOKS - 1) + observed
        share = observed / np.maximum(self._weights, 1.0)
        miss = nodes - self.nodes
        self.nodes = self.nodes + share[:, None] * miss
        self._noise = self._noise + share * (np.maximum(sigma, 0.0) ** 2 - self._noise)
        found = (1.0 - share) * np.mean(miss**2, axis=1)
        self._spread = (1.0 - share) * self._spread + share * found

    @property
    def observed(self) -> Bool[np.ndarray, "n"]:
        """Nodes that were seen at all."""
        return self._weights > 0.0

    @property
    def variance(self) -> Float64[np.ndarray, "n"]:
        """Of the mean's coordinates [m^2]; swinging, which is more than noise, does not average."""
        swinging = np.maximum(self._spread - self._noise, 0.0)
        return self._noise / np.maximum(self._weights, 1.0) + swinging


class _Swing:
    """How the positions answer to damping: two models moved alike, one of them damped more."""

    def __init__(self) -> None:
        self._states: list[RodState] = []
        self._motion: MotionState | None = None
        self._time = 0
        self._slopes: deque[tuple[int, Float64[np.ndarray, "n 3"]]] = deque()

    def restart(self) -> None:
        """The material changed: both models are what the estimate is, once more."""
        self._states = []

    def follow(self, estimator: StateEstimator) -> None:
        """Moves both models to where the estimate is."""
        elapsed = (estimator.time - self._time) * 1e-9
        if not self._states or self._motion is None or not 0.0 < elapsed < SWING_MEMORY:
            self._states = [estimator.state, estimator.state]
            self._slopes.clear()
        else:
            steps = max(1, math.ceil(elapsed / SWING_STEP))
            action = mean_twists(self._motion, estimator.motion, elapsed).reshape(1, 2, 6)
            blocks = np.zeros(steps, dtype=np.int64)
            self._states = [
                rod.rollout(
                    RolloutSpec(
                        state,
                        action,
                        elapsed / steps,
                        block_of_step=blocks,
                        obstacles=estimator.supports,
                    )
                ).final
                for rod, state in zip(_pair(estimator.rod), self._states, strict=True)
            ]
            there, here = (state.positions for state in self._states)
            self._slopes.append((estimator.time, (there - here) / SWUNG))
            while (estimator.time - self._slopes[0][0]) * 1e-9 > SWING_MEMORY:
                self._slopes.popleft()
        self._motion, self._time = estimator.motion, estimator.time

    def slope_at(self, stamp: int) -> Float64[np.ndarray, "n 3"] | None:
        """Change of the positions at a time with the damping's logarithm [m]."""
        if not self._slopes:
            return None
        return min(self._slopes, key=lambda entry: abs(entry[0] - stamp))[1]


def _way(before: MotionState, after: MotionState) -> float:
    """By how much the grips have gone from one place to another, rotations included [m]."""
    change = mean_twists(before, after, 1.0)
    return float(np.max(np.linalg.norm(change, axis=2) @ np.array([1.0, LEVER])))


def _size(change: Float64[np.ndarray, "n 3"]) -> float:
    """Root mean square over the nodes [m]."""
    return float(np.sqrt(np.mean(np.sum(change**2, axis=1))))


def _pair(rod: Rod) -> tuple[Rod, Rod]:
    more = replace(rod.properties, damping=rod.properties.damping * math.exp(SWUNG))
    return rod.with_properties(more), rod
