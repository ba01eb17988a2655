"""Schemes of time integration, as shares of earlier solves in where a solve starts from.

A solve over a time h finds x with velocity (x - base) / h. Its base, and the displacement that
inertia would add to it, are sums of the last solves' positions: see `kernels`.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Literal

import numpy as np
from jaxtyping import Float64

from lariat.rod.launch.layout import TimeRow

Scheme = Literal["euler", "sdirk2"]
HISTORY: dict[str, int] = {"euler": 2, "sdirk2": 4}
"""How many of the solves before enter one."""

_GAMMA = 1.0 - math.sqrt(0.5)
_R = (1.0 - _GAMMA) / _GAMMA


def _row(
    duration: float, carries: float, back: int, moved: float, base: tuple, momentum: tuple
) -> list[float]:
    pad = [0.0] * 4
    row = [duration, carries, float(back), moved]
    return row + (list(base) + pad)[:4] + (list(momentum) + pad)[:4]


_ROWS = {
    # Without velocity: every solve is a step downhill of its own.
    "still": [_row(1.0, 0.0, 1, 1.0, (1.0,), ())],
    "euler": [_row(1.0, 1.0, 1, 1.0, (1.0,), (1.0, -1.0))],
    # The displacement in the last full step is d0 = x1 - (1 - r) x3 - r x2 for the first stage,
    # and d0 + r (d1 - d0) with d1 = x1 - x2 for the second, where numbers count solves back.
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


def time_table(
    scheme: str, dt: float | Float64[np.ndarray, "H"], horizon: int, substeps: int
) -> Float64[np.ndarray, "S 12"]:
    """A row for every solve of a roll-out, as `layout` names its entries.

    Args:
        dt: Duration of a step, or of each [s].
    """
    if np.ndim(dt) == 0:
        return _steady(scheme, float(dt), horizon, substeps)
    return _rows(scheme, np.asarray(dt, float), horizon, substeps)


@lru_cache(maxsize=64)
def _steady(scheme: str, dt: float, horizon: int, substeps: int) -> Float64[np.ndarray, "S 12"]:
    """Cached, for a controller asks for the same steps a hundred times a second."""
    rows = _rows(scheme, np.asarray(dt), horizon, substeps)
    rows.setflags(write=False)
    return rows


def _rows(
    scheme: str, dt: Float64[np.ndarray, "..."], horizon: int, substeps: int
) -> Float64[np.ndarray, "S 12"]:
    stages = np.array(_ROWS[scheme])
    rows = np.tile(stages, (horizon * substeps, 1))
    h = np.repeat(np.broadcast_to(dt / substeps, horizon), substeps * len(stages))
    rows[:, TimeRow.DURATION] *= h
    rows[:, TimeRow.GRIP_DURATION] *= h
    return rows
