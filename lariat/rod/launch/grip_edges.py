"""Grip edges: values of the nodes of a rod, and of the chain with one more node for each clamp."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64


def with_grips(
    values: Float64[np.ndarray, "*b n 3"], clamps: tuple[int, int]
) -> Float64[np.ndarray, "*b k 3"]:
    """Repeat the values of the end nodes for the outer nodes of grip edges.

    Args:
        values: Values of the nodes of a rod.
        clamps: Number of clamps at the left and at the right end.
    """
    left, right = clamps
    chain = np.empty((*values.shape[:-2], values.shape[-2] + left + right, 3))
    chain[..., left : chain.shape[-2] - right, :] = values
    if left:
        chain[..., 0, :] = values[..., 0, :]
    if right:
        chain[..., -1, :] = values[..., -1, :]
    return chain


def fold_grips(
    gradient: Float64[np.ndarray, "k 3"], clamps: tuple[int, int]
) -> Float64[np.ndarray, "n 3"]:
    """Return the gradient in the nodes of a rod, from that in the nodes of the chain.

    Args:
        gradient: Gradient in the nodes of the chain; the transpose of `with_grips` is applied.
        clamps: Number of clamps at the left and at the right end.
    """
    left, right = clamps
    nodes = gradient[left : len(gradient) - right].copy()
    nodes[0] += left * gradient[0]
    nodes[-1] += right * gradient[-1]
    return nodes
