"""Rest shapes and buckling: a strut under axial load, and the load at which it gives way."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from lariat.geometry import Pose
from lariat.rod import Rod, RodProperties, forces, state_along

UP = np.array([1.0, 0.0, 0.0, 0.0])
"""Orientation of both grips, wxyz: z points up, along the strut."""


def main() -> Figure:
    strut = RodProperties(length=0.3, diameter=0.003, linear_density=0.01, youngs_modulus=2e9)
    # A trace of weight across the strut breaks the symmetry.
    rod = Rod(strut, 60, gravity=(1e-3, 0.0, 0.0))
    euler = 4.0 * np.pi**2 * strut.bending_stiffness / strut.length**2  # both ends clamped
    s = np.linspace(0.0, 1.0, rod.node_count)[:, None]
    shortenings = np.array([0.1, 0.2, 0.3, 0.4, 0.8, 1.5, 3, 6, 12, 25, 50, 100, 150]) * 1e-3

    loads, figure, (shapes, curve) = [], *plt.subplots(1, 2, figsize=(8, 4))
    for shortening in shortenings:
        chord = strut.length - shortening
        bulge = 2.0 / np.pi * np.sqrt(shortening * strut.length) * np.sin(np.pi * s) ** 2
        guess = state_along(np.hstack([bulge, 0.0 * s, chord * s]), UP, UP)
        grips = Pose(np.zeros(3), UP), Pose(np.array([0.0, 0.0, chord]), UP)
        rest = rod.rest(*grips, guess)
        assert rest.converged
        assert rest.stable
        loads.append(-forces(rod, rest.state)[0, 2] / euler)
        shapes.plot(*rest.state.positions[:, ::2].T, color="C0", alpha=0.6)
    critical = np.interp(1.5e-3, shortenings, loads)
    print(f"load just after buckling: {critical:.4f} of Euler's, which is {euler:.3f} N")
    shapes.set(xlabel="x [m]", ylabel="z [m]", aspect="equal")
    curve.plot(1e3 * shortenings, loads, "o-")
    curve.axhline(1.0, color="0.6")
    curve.set_xscale("log")
    curve.set(xlabel="shortening [mm]", ylabel="load / Euler's load [-]")
    return figure


if __name__ == "__main__":
    main().savefig("04_rest_shapes_and_buckling.png")
