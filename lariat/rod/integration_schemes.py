"""Time integration schemes, as weights of earlier solves.

A solve over a time h finds positions x with velocity (x - base) / h. The base, and the displacement
that inertia adds to it, are weighted sums of the positions of the last solves; see `kernels`.

"euler" is implicit Euler. "sdirk2" is the L-stable singly diagonally implicit Runge-Kutta method of
order two: Alexander, "Diagonally implicit Runge-Kutta methods for stiff O.D.E.'s", SIAM J. Numer.
Anal. 14 (1977).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Literal

import numpy as np
from jaxtyping import Float64

from lariat.rod.launch.layout import TimeRow

Scheme = Literal["euler", "sdirk2"]
HISTORY_LENGTHS: dict[str, int] = {"euler": 2, "sdirk2": 4}
"""Number of earlier solves that enter a solve of each scheme."""

_GAMMA = 1.0 - math.sqrt(0.5)
"""Duration of a stage of SDIRK2, in steps [-]."""
_R = (1.0 - _GAMMA) / _GAMMA
"""Ratio r = (1 - gamma) / gamma of the rest of a step to its first stage [-]."""


def _row(
    duration: float,
    keeps_velocity: float,
    grip_solves_back: int,
    grip_duration: float,
    base: tuple[float, ...],
    momentum: tuple[float, ...],
) -> list[float]:
    """Return a `TimeRow` for a step of duration one."""
    pad = [0.0] * 4
    row = [duration, keeps_velocity, float(grip_solves_back), grip_duration]
    row.append(1.0)
    return row + (list(base) + pad)[:4] + (list(momentum) + pad)[:4]


_STAGE_ROWS = {
    # Without velocity, every solve is a proximal step that decreases the energy.
    "still": [_row(1.0, 0.0, 1, 1.0, (1.0,), ())],
    "euler": [_row(1.0, 1.0, 1, 1.0, (1.0,), (1.0, -1.0))],
    # The displacement of the last full step is d0 = x1 - (1 - r) x3 - r x2 in the first stage, and
    # d0 + r (d1 - d0) with d1 = x1 - x2 in the second, where xk is the solution k solves ago.
    "sdirk2": [
        _row(_GAMMA, 1.0, 1, _GAMMA, (1.0,), (1.0, -_R, _R - 1.0)),
        _row(
            _GAMMA,
            1.0,
            2,
            1.0,
            (_R, 1.0 - _R),
            (_R, 1.0 - 2.0 * _R, -_R * (1.0 - _R), -((1.0 - _R) ** 2)),
        ),
    ],
}
"""A `TimeRow` for each stage of a step of duration one."""


def time_table(
    scheme: str, dt: float | Float64[np.ndarray, "H"], horizon: int, substeps: int
) -> Float64[np.ndarray, "S 13"]:
    """Return a row for every solve of a roll-out, with columns as in `layout.TimeRow`.

    Args:
        scheme: Name of a scheme, or "still" for steps without velocity.
        dt: Duration of a step, or of each step [s].
        horizon: Number of steps H.
        substeps: Substeps of a step.
    """
    if isinstance(dt, float) or np.ndim(dt) == 0:
        return _uniform_rows(scheme, float(dt), horizon, substeps)
    return _rows(scheme, np.asarray(dt, float), horizon, substeps)


@lru_cache(maxsize=64)
def _uniform_rows(
    scheme: str, dt: float, horizon: int, substeps: int
) -> Float64[np.ndarray, "S 13"]:
    """Return the rows of equal steps; cached, since a controller repeats them in every period."""
    rows = _rows(scheme, np.asarray(dt), horizon, substeps)
    rows.setflags(write=False)
    return rows


def _rows(
    scheme: str, dt: Float64[np.ndarray, "..."], horizon: int, substeps: int
) -> Float64[np.ndarray, "S 13"]:
    stages = np.array(_STAGE_ROWS[scheme])
    rows = np.tile(stages, (horizon * substeps, 1))
    h = np.repeat(np.broadcast_to(dt / substeps, horizon), substeps * len(stages))
    rows[:, TimeRow.DURATION] *= h
    rows[:, TimeRow.GRIP_DURATION] *= h
    return rows
