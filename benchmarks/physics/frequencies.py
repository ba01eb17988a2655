"""Natural frequencies of straight beams, against Euler and Bernoulli's.

The rod moves by its second-order scheme, linearized: forward sensitivities of a roll-out along a
mode of the continuum. The amplitude of the mode then obeys a_k+1 = c1 a_k - c2 a_k-1, whose roots
are the amplification factor R(i omega dt) of the scheme and its conjugate. Solving for omega leaves
no error of the time step, only that of the discretization in space.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float64
from scipy.optimize import root_scalar

from benchmarks.physics.cases import Case
from benchmarks.physics.closed_forms import WEIGHTLESS
from lariat.rod import Rod, RodProperties, RolloutSpec, StateDirections
from lariat.rod.model import End

BEAM = RodProperties(
    0.45, 1e-4, 0.044, 1e6, stretch_stiffness=1e4, damping=0.0, internal_damping=0.0
).with_stiffness(2e-4)
"""Beam so thin that rotary inertia, and so stiff that shear, do not count."""
STEPS_PER_PERIOD, PERIODS = 40, 2
"""Steps in a period of the mode, and periods that are simulated."""
MAX_ERROR = {1: 0.3, 2: 0.7, 3: 1.5}
"""Largest allowed error at n = 40, by mode [%]."""


@dataclass(frozen=True)
class Beam:
    """Straight beam by the hold of its ends, and the modes of its continuum, in its lengths."""

    left: End
    right: End

    def wave_number(self, mode: int) -> float:
        """Return the wave number of a mode, from the lowest mode 1 on [1/L]."""
        if self.right == "pinned":
            return math.pi * mode
        # cos(b) cosh(b) = 1 between clamps, -1 at a clamp and a free end.
        sign = 1.0 if self.right == "clamped" else -1.0
        middle = math.pi * (mode + 0.5 * sign)
        return root_scalar(
            lambda b: math.cos(b) - sign / math.cosh(b), bracket=(middle - 1.0, middle + 1.0)
        ).root

    def deflection(
        self, mode: int, s: Float64[np.ndarray, "k"]
    ) -> tuple[Float64[np.ndarray, "k"], Float64[np.ndarray, "k"]]:
        """Return deflection and slope of a mode at arc lengths in units of the length."""
        b = self.wave_number(mode)
        if self.right == "pinned":
            return np.sin(b * s), b * np.cos(b * s)
        sign = 1.0 if self.right == "clamped" else -1.0
        ratio = (math.cosh(b) - sign * math.cos(b)) / (math.sinh(b) - sign * math.sin(b))
        value = np.cosh(b * s) - np.cos(b * s) - ratio * (np.sinh(b * s) - np.sin(b * s))
        slope = np.sinh(b * s) + np.sin(b * s) - ratio * (np.cosh(b * s) - np.cos(b * s))
        return value, b * slope


def error(beam: Beam, mode: int, node_count: int) -> float:
    """Return the relative error of the angular frequency of a mode [%]."""
    stiffness = BEAM.bending_stiffness / BEAM.linear_density
    exact = beam.wave_number(mode) ** 2 * math.sqrt(stiffness) / BEAM.length**2
    rod = Rod(BEAM, node_count, beam.left, beam.right, WEIGHTLESS, tolerance=1e-9, scheme="sdirk2")
    start = rod.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    left, right = rod.model.clamps
    edges = (np.arange(node_count - 1) + 0.5) / (node_count - 1)
    frames = np.concatenate([np.zeros(left), edges, np.ones(right)])
    shape, _ = beam.deflection(mode, np.linspace(0.0, 1.0, node_count))
    _, slope = beam.deflection(mode, frames)
    direction = StateDirections(
        (BEAM.length * shape[:, None] * np.array([0.0, 0.0, 1.0]))[None],
        # A rod along x that rises by dz / dx turns about -y.
        (slope[:, None] * np.array([0.0, -1.0, 0.0]))[None],
        np.zeros((1, node_count, 3)),
        np.zeros((1, len(start.orientations), 3)),
    )
    dt = 2.0 * math.pi / exact / STEPS_PER_PERIOD
    spec = RolloutSpec(start, np.zeros((PERIODS * STEPS_PER_PERIOD, 2, 6)), dt)
    motion = rod.linearize(spec, state_directions=direction, with_actions=False)
    amplitudes = motion.d_positions_d_state[:, :, 2, 0] @ shape
    return 100.0 * abs(_angular_frequency(amplitudes, dt) / exact - 1.0)


def _angular_frequency(amplitudes: Float64[np.ndarray, "H"], dt: float) -> float:
    """Return the frequency that the scheme turns into a sequence of amplitudes [rad/s]."""
    before = np.stack([amplitudes[1:-1], -amplitudes[:-2]], axis=1)
    (c1, c2), *_ = np.linalg.lstsq(before, amplitudes[2:], rcond=None)
    factor = np.roots([1.0, -c1, c2])[0]
    # R(z) = (1 + (1 - 2 gamma) z) / (1 - gamma z)^2 = factor, a quadratic equation in z.
    gamma = 1.0 - math.sqrt(0.5)
    candidates = np.roots(
        [factor * gamma**2, -2.0 * factor * gamma - 1.0 + 2.0 * gamma, factor - 1.0]
    )
    return float(abs(min(candidates, key=abs).imag)) / dt


BEAMS: dict[str, Beam] = {
    "clamped": Beam("clamped", "clamped"),
    "cantilever": Beam("clamped", "free"),
    "pinned": Beam("pinned", "pinned"),
}
CASES = tuple(
    Case(
        f"{name}, mode {mode}",
        "%",
        partial(error, beam, mode),
        (10, 20, 40, 80, 160),
        {40: bound},
        1.8,
    )
    for name, beam in BEAMS.items()
    for mode, bound in MAX_ERROR.items()
)
