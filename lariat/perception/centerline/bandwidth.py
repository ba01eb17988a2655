"""Memory of a chain's fit."""

import numpy as np

BANDWIDTH = 12
"""Stored diagonals of the symmetric matrix, the main one included: four nodes of three."""
MARGIN = BANDWIDTH - 1
"""Number of rows of zeros before and behind it."""


def scratch(node_count: int) -> tuple[np.ndarray, ...]:
    """Return the arrays that a fit works in, in the order of the kernel's arguments.

    Args:
        node_count: Number of nodes of the chain.
    """
    rows = 3 * node_count + 2 * MARGIN
    return (
        np.zeros((rows, 1, BANDWIDTH)),
        np.zeros((rows, 1, BANDWIDTH)),
        np.zeros((node_count + 3, 4)),
        np.zeros((node_count - 1, 4, 3)),
        np.zeros((node_count - 1, 4, 6)),
        np.zeros((3 * node_count, 2)),
        np.zeros(rows),
    )
