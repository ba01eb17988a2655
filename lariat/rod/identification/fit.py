"""Fits a rod's material to measured motion.

Gauss-Newton with Levenberg damping on open-loop roll-outs of windows. The windows grow: short ones
forgive a wrong material, long ones are what a prediction is judged by. It begins with a search
over decades of stiffness and damping, so that the result does not depend on where it started.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from jaxtyping import Bool, Float64

from lariat.rod.identification import posterior
from lariat.rod.identification.material import CORE, SPREADS, Material
from lariat.rod.identification.motion import Motion
from lariat.rod.identification.posterior import Evidence
from lariat.rod.identification.rod_twin import Replica, Window
from lariat.rod.properties import RodProperties

Report = Callable[[str, float], None]
"""Called with what is being done and the share of all work that is done [-]."""

KNOTS = 7
"""Most knots of a profile."""
LEAST_NOISE = 5e-4
"""No model of a rope is better than this [m]."""
COUNTING = 1.0 / 50.0
"""Share of the measured points that err independently of the others."""
SHORT, MIDDLE, LONG = 0.4, 1.2, 5.0
"""Windows of the stages [s]."""
SEARCHED = 24
"""Windows of the first search."""
LENGTHENED = 1e-3
"""Of the length, for its derivative [-]."""
STIFFNESS_RANGE = np.logspace(-4.5, 0.5, 11)
"""EI / (weight per length times length^3) of ropes and cables [-]."""


@dataclass(frozen=True)
class Fit:
    """A rope's material as far as the motion shows it."""

    material: Material
    x: Float64[np.ndarray, "P"]
    """The vector of unknowns; see `material`."""
    covariance: Float64[np.ndarray, "P P"]
    """Of that vector."""
    prediction_noise: float
    """Typical error of a coordinate in the longest windows [m]."""
    rope_length: float
    """Between the innermost held vertices [m]."""
    length_scale: float
    """That length against what the distances between the vertices say [-]."""
    seconds: float
    """Of every sequence that was seen [s]."""

    @property
    def properties(self) -> RodProperties:
        """The rod."""
        return self.material.properties(self.x)


@dataclass
class _Search:
    replica: Replica
    material: Material
    information: Float64[np.ndarray, "P P"]
    """Of what was believed before."""
    noise: float = 0.01

    def cost(self, x: Float64[np.ndarray, "P"], windows: list[Window]) -> float:
        replica = self.replica
        predicted = replica.predicted(self.material.properties(x), windows)
        residuals = (replica.measured(windows) - predicted).reshape(-1, 3)
        return posterior.loss(residuals, self.noise, COUNTING) + self.belief(x).cost

    def belief(self, x: Float64[np.ndarray, "P"]) -> Evidence:
        return posterior.belief(x, self.information)

    def evidences(
        self, x: Float64[np.ndarray, "P"], windows: list[Window], free: Bool[np.ndarray, "P"]
    ) -> list[Evidence]:
        """Of every window."""
        replica = self.replica
        predicted, slopes = linearized(replica, self.material, x, windows, free)
        residuals = replica.measured(windows) - predicted
        return [
            posterior.evidence(
                residuals[b].reshape(-1, 3),
                slopes[b].reshape(-1, 3, len(x)),
                self.noise,
                COUNTING,
            )
            for b in range(len(windows))
        ]

    def descended(
        self,
        x: Float64[np.ndarray, "P"],
        windows: list[Window],
        free: Bool[np.ndarray, "P"],
        iterations: int,
        report: Callable[[float], None],
    ) -> tuple[Float64[np.ndarray, "P"], float]:
        """The minimum that Levenberg's steps lead to, and its cost."""
        levenberg = 1e-2
        cost = self.cost(x, windows)
        for k in range(iterations):
            report(k / iterations)
            found = sum(self.evidences(x, windows, free), self.belief(x))
            for _ in range(6):
                trial = self.material.bounded(x + posterior.step(found, free, levenberg))
                new = self.cost(trial, windows)
                if new < cost:
                    break
                levenberg *= 8.0
            else:
                break
            gain = cost - new
            x, cost = trial, new
            levenberg = max(0.2 * levenberg, 1e-6)
            if gain < 1e-3 * cost:
                break
        return x, cost

    def calibrate(self, x: Float64[np.ndarray, "P"], windows: list[Window]) -> None:
        """Sets the noise to what the errors are."""
        predicted = self.replica.predicted(self.material.properties(x), windows)
        error = np.abs(self.replica.measured(windows) - predicted)
        self.noise = max(float(1.25 * np.mean(error)), LEAST_NOISE)


def identify(
    motion: Motion,
    start: RodProperties | None = None,
    seconds: float | None = None,
    report: Report = lambda what, share: None,
) -> Fit:
    """The material of a rope from its motion.

    Args:
        start: Where to begin; its diameter and linear density are taken as they are, its length
            is not used.
        seconds: Of every sequence that may be seen, from its begin; all of it without.

    Raises:
        ValueError: The motion is too short to fit to.
    """
    frames = motion.vertices.shape[1]
    if seconds is not None:
        frames = min(frames, round(seconds / motion.dt))
    if frames < 10:
        raise ValueError(
            f"{frames} frames of {motion.dt} s are too few to fit to; give at least 10"
        )
    replica = Replica(motion.until(frames))
    material = _material(replica, start or unknown_rope())
    search = _Search(replica, material, material.belief(SPREADS))

    def windows(length: float) -> list[Window]:
        return replica.windows(max(5, round(length / motion.dt)))

    short, middle, long = (windows(length) for length in (SHORT, MIDDLE, LONG))
    x = _searched(search, short, lambda share: report("searching", 0.1 * share))
    core = material.chosen((*CORE, "length", "rest_curvature"))
    every = np.ones(material.count, dtype=bool)
    stages = ((short, core, 8, "short"), (middle, every, 8, "middle"), (long, every, 8, "long"))
    for k, (stage, free, iterations, name) in enumerate(stages):
        begins = 0.1 + 0.3 * k
        search.calibrate(x, stage)
        x, _ = search.descended(
            x,
            stage,
            free,
            iterations,
            lambda share, begins=begins, name=name: report(
                f"fitting {name} windows", begins + 0.3 * share
            ),
        )
    search.calibrate(x, long)
    clusters = search.evidences(x, long, every)
    covariance = posterior.covariance(sum(clusters, search.belief(x)), clusters, every)
    report("done", 1.0)
    scale = float(np.exp(x[material.groups["length"]][0]))
    return Fit(
        material, x, covariance, search.noise, scale * replica.length, scale, frames * motion.dt
    )


def unknown_rope() -> RodProperties:
    """What is believed of a rope of which nothing is known; only ratios of it matter."""
    return RodProperties(
        length=1.0,
        diameter=0.008,
        linear_density=0.05,
        youngs_modulus=1e7,
        damping=0.5,
        internal_damping=0.01,
    )


def linearized(
    replica: Replica,
    material: Material,
    x: Float64[np.ndarray, "P"],
    windows: list[Window],
    free: Bool[np.ndarray, "P"],
) -> tuple[Float64[np.ndarray, "B H k 3"], Float64[np.ndarray, "B H k 3 P"]]:
    """Predictions, and their slopes in the free unknowns; zero in the others."""
    properties = material.properties(x)
    length = material.groups["length"].start
    others = free & (np.arange(len(x)) != length)
    names, chain = material.derivatives(properties, others)
    predicted, by_parameter = replica.linearized(properties, windows, names)
    slopes = by_parameter @ chain
    if free[length]:
        # By a difference: with the length, the start and the motion of the grips change too.
        longer = x.copy()
        longer[length] += LENGTHENED
        there = replica.predicted(material.properties(longer), windows)
        slopes[..., length] = (there - predicted) / LENGTHENED
    return predicted, slopes


def _material(replica: Replica, start: RodProperties) -> Material:
    knots = int(np.clip(len(replica.arcs) - 1, 2, KNOTS))
    clamped = "clamped" in replica.kinds
    believed = replace(start, length=replica.rod_length(1.0))
    return Material(believed, knots, knots if clamped else 0)


def _searched(
    search: _Search, windows: list[Window], report: Callable[[float], None]
) -> Float64[np.ndarray, "P"]:
    """The best of a coarse grid over stiffness and dampings."""
    material = search.material
    believed = material.believed
    some = windows[:: max(1, len(windows) // SEARCHED)]
    at = material.groups
    unit = 9.81 * believed.linear_density * search.replica.length**3
    grid = list(product(STIFFNESS_RANGE, (0.5, 2.0), (0.003, 0.03)))
    # Where the user begins is one more candidate; a vector of zeros is just that.
    candidates = [np.zeros(material.count)]
    for stiffness, damping, internal in grid:
        x = np.zeros(material.count)
        x[at["stiffness"]] = np.log(stiffness * unit / believed.bending_stiffness)
        x[at["damping"]] = np.log(damping / believed.damping)
        x[at["internal_damping"]] = np.log(internal / believed.internal_damping)
        candidates.append(x)
    best, least = candidates[0], np.inf
    for k, x in enumerate(candidates):
        report(k / len(candidates))
        predicted = search.replica.predicted(material.properties(x), some)
        residuals = (search.replica.measured(some) - predicted).reshape(-1, 3)
        cost = posterior.loss(residuals, search.noise, COUNTING)
        if cost < least:
            best, least = x, cost
    return best
