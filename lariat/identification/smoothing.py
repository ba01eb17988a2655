"""Measured motion without the noise that differs from frame to frame.

Cubics are fitted to the frames around each one (Savitzky and Golay, 1964). The number of frames is
the one that predicts a left-out frame best, so that a motion without noise is left as it is.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64
from numpy.lib.stride_tricks import sliding_window_view

HALF_WIDTHS = (2, 3, 4, 6, 8, 11, 15)
"""Numbers of frames that are fitted on either side of a frame."""
DEGREE = 3
"""Degree of the polynomials."""


def smoothed(
    vertices: Float64[np.ndarray, "S T V 3"],
) -> tuple[Float64[np.ndarray, "S T V 3"], Float64[np.ndarray, "V"]]:
    """Return smoothed vertices, each with a number of frames of its own, and their noise [m].

    The noise is the standard deviation of a coordinate from frame to frame. A motion that is too
    fast for its frames has more by this estimate than it has.
    """
    best, least = vertices.copy(), np.full(vertices.shape[2], np.inf)
    noise = np.zeros(vertices.shape[2])
    for half in HALF_WIDTHS:
        if 2 * half + 1 > vertices.shape[1]:
            break
        fit, leverage = _local_cubics(vertices, half)
        left_out = (vertices - fit) / (1.0 - leverage)[:, None, None]
        error = np.mean(left_out**2, axis=(0, 1, 3))
        better = error < least
        best[:, :, better], least[better] = fit[:, :, better], error[better]
        noise[better] = np.sqrt(error[better] * np.mean(1.0 - leverage))
    return best, noise


def _local_cubics(
    vertices: Float64[np.ndarray, "S T V 3"], half: int
) -> tuple[Float64[np.ndarray, "S T V 3"], Float64[np.ndarray, "T"]]:
    """Return the fit and the weight that every frame has in its own fit [-]."""
    width = 2 * half + 1
    basis = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, width), DEGREE + 1))[0]
    smoother = basis @ basis.T
    middle = sliding_window_view(vertices, width, axis=1) @ smoother[half]
    first = np.einsum("ij,sjvc->sivc", smoother[:half], vertices[:, :width])
    last = np.einsum("ij,sjvc->sivc", smoother[half + 1 :], vertices[:, -width:])
    leverage = np.diag(smoother)
    inner = np.full(vertices.shape[1] - 2 * half, leverage[half])
    return (
        np.concatenate([first, middle, last], axis=1),
        np.concatenate([leverage[:half], inner, leverage[half + 1 :]]),
    )
