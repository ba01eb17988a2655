"""Exact rest shape of a heavy inextensible rope between two clamps in a vertical plane."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64
from scipy.integrate import solve_bvp

GRAVITY = 9.81
"""Gravitational acceleration [m/s^2]."""


def heavy_elastica(
    guess: Float64[np.ndarray, "n 3"],
    pitches: tuple[float, float],
    length: float,
    stiffness: float,
    linear_density: float,
) -> Float64[np.ndarray, "n 3"]:
    """Return points at equal arc length of the rest shape near a guess, where y = 0 [m].

    Solves x' = cos(a), z' = sin(a), EI a'' = F_x sin(a) - F_z cos(a), F_z' = weight per length for
    given positions and directions of both ends.

    Args:
        guess: Points near the solution, whose ends are those of the rope [m].
        pitches: Angles of both grips above x [rad].
        length: Length of the rope [m].
        stiffness: Bending stiffness EI [N m^2].
        linear_density: Mass per length [kg/m].
    """
    weight = GRAVITY * linear_density
    (x0, _, z0), (x1, _, z1) = guess[0], guess[-1]

    def slope(_: np.ndarray, y: np.ndarray) -> np.ndarray:
        cosine, sine = np.cos(y[2]), np.sin(y[2])
        moment = (y[4] * sine - y[5] * cosine) / stiffness
        return np.array([cosine, sine, y[3], moment, 0.0 * y[4], weight + 0.0 * y[5]])

    def residual(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        left = (a[0] - x0, a[1] - z0, a[2] - pitches[0])
        right = (b[0] - x1, b[1] - z1, b[2] - pitches[1])
        return np.array(left + right)

    s = np.linspace(0.0, length, len(guess))
    rises = np.gradient(guess[:, 2], s), np.gradient(guess[:, 0], s)
    angle = np.unwrap(np.arctan2(*rises))
    pull = np.full_like(s, 0.05)
    y = np.stack(
        [guess[:, 0], guess[:, 2], angle, np.gradient(angle, s), pull, weight * (s - length / 2.0)]
    )
    for tolerance in (1e-4, 1e-9):
        solution = solve_bvp(slope, residual, s, y, tol=tolerance, max_nodes=100_000)
        assert solution.success, solution.message
        s, y = solution.x, solution.y
    x, z = solution.sol(np.linspace(0.0, length, len(guess)))[:2]
    return np.stack([x, np.zeros_like(x), z], axis=1)
