"""Fit of a rod's material to measured motion.

Gauss-Newton with Levenberg damping on open-loop roll-outs of windows. The windows grow: short ones
tolerate a wrong material, long ones measure the quality of a prediction. A grid search comes first,
over decades of stiffness and damping, so that the result does not depend on where it started.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from jaxtyping import Bool, Float64

from lariat.identification import posterior
from lariat.identification.material import Material
from lariat.identification.motion import Grip, Motion
from lariat.identification.posterior import Evidence
from lariat.identification.rod_twin import RodTwin, Window
from lariat.rod.properties import RodProperties

ReportProgress = Callable[[str, float], None]
"""Callback that takes the name of the current phase and the share of all work done [-]."""

MAX_PROFILE_KNOTS = 7
"""Largest number of knots of a profile."""
MIN_NOISE = 5e-4
"""Smallest standard deviation of a prediction [m]: that of a rod in place of the rope."""
INDEPENDENT_SHARE = 1.0 / 50.0
"""Share of the measured points whose errors are independent, for the balance with the prior [-].
The stated covariance follows from the scatter of blocks instead."""
WINDOW_DURATIONS = (0.4, 1.2, 5.0)
"""Durations of the short, middle and long windows [s]."""
MAX_SEARCH_WINDOWS = 24
"""Largest number of windows of the grid search."""
BLOCK_COUNT = 12
"""Number of blocks whose scatter gives the standard deviations, where the motion is long enough."""
MIN_BLOCK_DURATION = 0.25
"""Least duration of a block [s]: errors are correlated for shorter times."""
LENGTH_DIFFERENCE = 1e-3
"""Step of the finite difference in the logarithm of the length [-]."""
NODE_REFINEMENT = 4.0 / 3.0
"""Error of a rod, relative to what twice its nodes change: second order in the edge length [-]."""
STEP_REFINEMENT = 4.0 / 3.0
"""Error of the steps, relative to what half their duration changes, if of second order [-]."""
OTHER_FRAME_DURATIONS = (0.25, 0.5, 2.0, 4.0)
"""Factors by which the time between frames may have been given wrongly [-]."""
CLEAR_DIFFERENCE = 5.0
"""Difference of costs above which one of two times is clearly the better one [-]."""
NOISE_SAMPLES = 16
"""Number of motions with other noise that show what noise changes in the fit."""
STIFFNESS_GRID = np.logspace(-4.5, 0.5, 11)
"""Values of EI / (weight per length times length^3) in the grid search [-]."""


@dataclass(frozen=True)
class Fit:
    """Material of a rope, with its uncertainty."""

    material: Material
    """Map from the unknowns to the rod."""
    x: Float64[np.ndarray, "P"]
    """Unknowns at the minimum, in the order of `material.groups`."""
    covariance: Float64[np.ndarray, "P P"]
    """Covariance of the unknowns."""
    prediction_noise: float
    """Typical error of a coordinate in the longest windows [m]."""
    rope_length: float
    """Length of the rope between the innermost held vertices [m]."""
    length_scale: float
    """Ratio of that length to the one estimated from distances between vertices [-]."""
    seconds: float
    """Duration that was used of every sequence [s]."""
    grip: Grip
    """Kind of the held vertices."""
    other_grip: float
    """Probability that the held vertices are of the other kind [-]; see `Motion.grip`."""
    frame_duration: float
    """Time between frames that the motion fits [s]: its own, or one that fits clearly better."""
    dt: float
    """Time between frames that was told [s]."""

    @property
    def properties(self) -> RodProperties:
        """Properties of the rod."""
        return self.material.properties(self.x)


@dataclass
class _Search:
    """Cost of vectors of unknowns, and its descent."""

    twin: RodTwin
    material: Material
    information: Float64[np.ndarray, "P P"]
    """Inverse covariance of the prior."""
    limits: Float64[np.ndarray, "P"]
    """Largest magnitudes of the unknowns."""
    noise: float = 0.01
    """Standard deviation of a coordinate [m]."""

    def cost(self, x: Float64[np.ndarray, "P"], windows: list[Window]) -> float:
        """Return the loss of windows plus that of the prior [-]."""
        twin = self.twin
        predicted = twin.predict(self.material.properties(x), windows)
        residuals = (twin.measured(windows) - predicted).reshape(-1, 3)
        return posterior.loss(residuals, self.noise, INDEPENDENT_SHARE) + self.prior(x).cost

    def prior(self, x: Float64[np.ndarray, "P"]) -> Evidence:
        """Return the evidence of the prior."""
        return posterior.prior(x, self.information)

    def evidences(
        self,
        x: Float64[np.ndarray, "P"],
        windows: list[Window],
        free: Bool[np.ndarray, "P"],
        block_length: int,
    ) -> list[Evidence]:
        """Return the evidence of every block of so many frames of every window."""
        twin = self.twin
        predicted, jacobian = linearize(twin, self.material, x, windows, free)
        residuals = twin.measured(windows) - predicted
        return [
            posterior.evidence(
                residuals[b, first : first + block_length].reshape(-1, 3),
                jacobian[b, first : first + block_length].reshape(-1, 3, len(x)),
                self.noise,
                INDEPENDENT_SHARE,
            )
            for b, window in enumerate(windows)
            for first in range(0, window.length, block_length)
        ]

    def descend(
        self,
        x: Float64[np.ndarray, "P"],
        windows: list[Window],
        free: Bool[np.ndarray, "P"],
        iterations: int,
        report: Callable[[float], None],
    ) -> tuple[Float64[np.ndarray, "P"], float]:
        """Return the end point of Levenberg-Marquardt steps, and its cost."""
        levenberg = 1e-2
        cost = self.cost(x, windows)
        for k in range(iterations):
            report(k / iterations)
            evidence = sum(self.evidences(x, windows, free, windows[0].length), self.prior(x))
            for _ in range(6):
                trial = x + posterior.gauss_newton_step(evidence, free, levenberg)
                trial = np.clip(trial, -self.limits, self.limits)
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

    def common_errors(
        self, x: Float64[np.ndarray, "P"], windows: list[Window], found: Evidence
    ) -> Float64[np.ndarray, "P P"]:
        """Return the covariance of errors that all blocks share, so that their scatter hides them.

        Of a rod that is a model, `MIN_NOISE` at as few independent points as the fit assumes. The
        others follow from what other predictions change in the fit, to first order. Nodes and time
        steps: Richardson's extrapolation from a finer rod. Arcs, tangents and initial states from
        few vertices: what the same fit finds in the rod's own motion. Tangents at `measured` grips:
        those of a polynomial of the next degree. Noise of grips, initial states and lengths: a
        parametric bootstrap (Efron and Tibshirani, 1993) with the noise of the vertices.
        """
        twin, every = self.twin, np.ones(len(x), dtype=bool)
        properties, length = self.material.properties(x), self.material.groups["length"]
        scale = properties.length / twin.length
        predicted, jacobian = linearize(twin, self.material, x, windows, every)
        residuals = (twin.measured(windows) - predicted).reshape(-1, 3)
        rows = jacobian.reshape(-1, 3, len(x))

        def descent(of: Float64[np.ndarray, "m 3"]) -> Float64[np.ndarray, "P"]:
            return posterior.evidence(of, rows, self.noise, INDEPENDENT_SHARE).descent

        at_minimum = descent(residuals)

        def error(change: Float64[np.ndarray, "B H k 3"]) -> Float64[np.ndarray, "P"]:
            moved = descent(residuals + change.reshape(-1, 3)) - at_minimum
            return inner @ moved

        inner = np.linalg.inv(found.information)
        of_data = found.information - self.information
        covariance = (MIN_NOISE / self.noise) ** 2 * inner @ of_data @ inner
        for nodes, substeps, factor in ((2, 1, NODE_REFINEMENT), (1, 2, STEP_REFINEMENT)):
            finer = twin.refined(nodes, substeps)
            of_resolution = factor * error(predicted - finer.predict(properties, windows))
            covariance += np.outer(of_resolution, of_resolution)
        if "clamped" in twin.kinds and twin.motion.grip == "measured":
            motions = (replace(m, tangent_vertices=5) for m in (twin.motion, twin.given))
            other = twin.of_motion(*motions)
            of_tangents = error(
                predicted - other.predict(other.of_length(properties, scale), windows)
            )
            of_tangents[length] += math.log(other.length / twin.length)
            covariance += np.outer(of_tangents, of_tangents)
        random, noise = np.random.default_rng(0), twin.motion.noise()[:, None]
        true = twin.given

        def residuals_of(other: RodTwin) -> Float64[np.ndarray, "B H k 3"]:
            rod = other.of_length(properties, scale)
            return other.measured(windows) - other.predict(rod, windows)

        own = twin.of_prediction(properties, windows)
        of_vertices = error(residuals_of(own))
        of_vertices[length] += math.log(own.length / twin.length)
        covariance += np.outer(of_vertices, of_vertices)
        without = twin.of_motion(true, true)
        before = residuals_of(without)
        for _ in range(NOISE_SAMPLES):
            noisy = replace(
                true, vertices=true.vertices + noise * random.normal(size=true.vertices.shape)
            )
            other = twin.of_motion(noisy, noisy.smoothed())
            of_noise = error(residuals_of(other) - before)
            of_noise[length] += math.log(other.length / without.length)
            covariance += np.outer(of_noise, of_noise) / NOISE_SAMPLES
        return covariance

    def other_grip(
        self, x: Float64[np.ndarray, "P"], windows: list[Window]
    ) -> tuple[float, Float64[np.ndarray, "P"]]:
        """Return the probability of the other kind of grips, and what it changes in the unknowns.

        Bayesian averaging of two models (Hoeting et al., 1999), which are equally likely at first.
        """
        if "clamped" not in self.twin.kinds or self.twin.motion.vertices.shape[2] < 5:
            return 0.0, np.zeros_like(x)
        every = np.ones(len(x), dtype=bool)
        (own, own_cost), (other, other_cost) = (
            search.descend(x, windows, every, 4, lambda share: None)
            for search in (self, replace(self, twin=self.twin.of_other_grip()))
        )
        return float(1.0 / (1.0 + np.exp(np.clip(other_cost - own_cost, -50.0, 50.0)))), other - own

    def frame_duration(self, x: Float64[np.ndarray, "P"], windows: list[Window]) -> float:
        """Return the time between frames that the motion fits clearly better [s], or its own.

        Gravity and the rope's length set a pace, which a motion of wrong frames has not.
        """
        twin, every = self.twin, np.ones(len(x), dtype=bool)
        costs = {}
        for factor in (1.0, *OTHER_FRAME_DURATIONS):
            dt = factor * twin.motion.dt
            other = RodTwin(replace(twin.motion, dt=dt), replace(twin.given, dt=dt))
            _, costs[dt] = replace(self, twin=other).descend(
                x, windows, every, 4, lambda share: None
            )
        best = min(costs, key=lambda dt: costs[dt])
        return best if costs[best] < costs[twin.motion.dt] - CLEAR_DIFFERENCE else twin.motion.dt

    def calibrate(self, x: Float64[np.ndarray, "P"], windows: list[Window]) -> None:
        """Set the noise to the mean error of the predictions."""
        predicted = self.twin.predict(self.material.properties(x), windows)
        error = np.abs(self.twin.measured(windows) - predicted)
        self.noise = max(float(1.25 * np.mean(error)), MIN_NOISE)


def identify(
    motion: Motion,
    start: RodProperties | None = None,
    seconds: float | None = None,
    report: ReportProgress = lambda phase, share: None,
) -> Fit:
    """Identify the material of a rope from its motion.

    Args:
        motion: Measured motion; with a yield curvature to find, or bodies that are touched, a rope
            without set or friction at the start of each sequence.
        start: Initial guess; its diameter and linear density are kept, its length is not used.
        seconds: Duration to use of every sequence, from its start [s]; by default all of it.
        report: Callback for progress.

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
    motion = motion.until(frames)
    twin = RodTwin(motion, motion.smoothed())
    material = _material(twin, start or generic_rope())
    search = _Search(
        twin,
        material,
        material.prior_information(material.per_unknown(lambda p: p.fit_prior.deviation)),
        material.per_unknown(lambda p: p.fit_prior.limit),
    )

    # Set and friction depend on all of a rope's history: their windows begin with the sequences.
    from_start = motion.bodies is not None or material.mean.yields

    def windows(length: float) -> list[Window]:
        every = twin.windows(max(5, round(length / motion.dt)))
        return [w for w in every if w.frame == 1] if from_start else every

    short, middle, long = (windows(length) for length in WINDOW_DURATIONS)
    x = _grid_search(search, short, lambda share: report("searching", 0.1 * share))
    core = material.per_unknown(lambda p: float(p.short_windows)) > 0.0
    every = np.ones(material.count, dtype=bool)
    stages = ((short, core, 8, "short"), (middle, every, 8, "middle"), (long, every, 8, "long"))
    for k, (stage, free, iterations, name) in enumerate(stages):
        begins = 0.1 + 0.3 * k
        search.calibrate(x, stage)
        x, _ = search.descend(
            x,
            stage,
            free,
            iterations,
            lambda share, begins=begins, name=name: report(
                f"fitting {name} windows", begins + 0.3 * share
            ),
        )
    search.calibrate(x, long)
    blocks = search.evidences(x, long, every, _block_length(long, motion.dt))
    covariance = posterior.covariance(blocks, search.information, every)
    covariance += search.common_errors(x, long, sum(blocks, search.prior(x)))
    few = short[:: math.ceil(len(short) / MAX_SEARCH_WINDOWS)]
    other_grip, change = search.other_grip(x, few)
    frame_duration = search.frame_duration(x, few)
    covariance += other_grip * np.outer(change, change)
    report("done", 1.0)
    scale = float(np.exp(x[material.groups["length"]][0]))
    return Fit(
        material,
        x,
        covariance,
        search.noise,
        scale * twin.length,
        scale,
        frames * motion.dt,
        motion.grip,
        other_grip,
        frame_duration,
        motion.dt,
    )


def _block_length(windows: list[Window], dt: float) -> int:
    """Number of frames of a block of measurements: a whole window, or an even part of it."""
    length = windows[0].length
    parts = math.ceil(BLOCK_COUNT / len(windows))
    return math.ceil(length / max(1, min(parts, int(length * dt / MIN_BLOCK_DURATION))))


def generic_rope() -> RodProperties:
    """Return the prior mean of an unknown rope; only the ratios of its fields matter."""
    return RodProperties(
        length=1.0,
        diameter=0.008,
        linear_density=0.05,
        youngs_modulus=1e7,
        damping=0.5,
        internal_damping=0.01,
    )


def linearize(
    twin: RodTwin,
    material: Material,
    x: Float64[np.ndarray, "P"],
    windows: list[Window],
    free: Bool[np.ndarray, "P"],
) -> tuple[Float64[np.ndarray, "B H k 3"], Float64[np.ndarray, "B H k 3 P"]]:
    """Return predictions, and their Jacobian in the free unknowns; zero in the others."""
    properties = material.properties(x)
    length = material.groups["length"].start
    others = free & (np.arange(len(x)) != length)
    names, chain = material.parameter_jacobian(twin.in_series(properties), others)
    predicted, by_parameter = twin.linearize(properties, windows, names)
    jacobian = by_parameter @ chain
    if free[length]:
        # A finite difference: the length also changes the initial state and the grips' motion.
        longer = x.copy()
        longer[length] += LENGTH_DIFFERENCE
        there = twin.predict(material.properties(longer), windows)
        jacobian[..., length] = (there - predicted) / LENGTH_DIFFERENCE
    return predicted, jacobian


def _material(twin: RodTwin, start: RodProperties) -> Material:
    knots = int(np.clip(len(twin.arcs) - 1, 2, MAX_PROFILE_KNOTS))
    clamped = "clamped" in twin.kinds
    mean = replace(start, length=twin.length)
    return Material(mean, knots, knots if clamped else 0, twin.motion.bodies is not None)


def _grid_search(
    search: _Search, windows: list[Window], report: Callable[[float], None]
) -> Float64[np.ndarray, "P"]:
    """Return the best point of a coarse grid over stiffness and dampings."""
    material = search.material
    mean = material.mean
    subset = windows[:: max(1, len(windows) // MAX_SEARCH_WINDOWS)]
    at = material.groups
    unit = 9.81 * mean.linear_density * search.twin.length**3
    grid = list(product(STIFFNESS_GRID, (0.5, 2.0), (0.003, 0.03)))
    # The initial guess, a vector of zeros, is one more candidate.
    candidates = [np.zeros(material.count)]
    for stiffness, damping, internal in grid:
        x = np.zeros(material.count)
        values = {
            "bending_stiffness": stiffness * unit,
            "damping": damping,
            "internal_damping": internal,
        }
        for name in at.keys() & values:
            x[at[name]] = np.log(values[name] / getattr(mean, name))
        candidates.append(x)
    best, least = candidates[0], np.inf
    for k, x in enumerate(candidates):
        report(k / len(candidates))
        predicted = search.twin.predict(material.properties(x), subset)
        residuals = (search.twin.measured(subset) - predicted).reshape(-1, 3)
        cost = posterior.loss(residuals, search.noise, INDEPENDENT_SHARE)
        if cost < least:
            best, least = x, cost
    return best
