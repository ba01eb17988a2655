"""Finite differences that gradients are compared with."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lariat.rod.results import Gradient, Linearization


def difference(of: Callable[[float], float], h: float) -> float:
    """Return the fourth-order central difference of a function at zero."""
    return (8.0 * (of(h) - of(-h)) - of(2.0 * h) + of(-2.0 * h)) / (12.0 * h)


def assert_columns_agree(
    forward: Linearization, found: Gradient, cost: np.ndarray, names: tuple[str, ...], rtol: float
) -> None:
    """Assert that forward columns give the gradient of a cost that is linear in the positions."""
    by_action = np.einsum("hnc,hnckef->kef", cost, forward.d_positions_d_actions)
    assert np.allclose(by_action, found.actions, rtol=rtol, atol=1e-9)
    by_parameter = np.einsum("hnc,hncp->p", cost, forward.d_positions_d_parameters)
    assert np.allclose(by_parameter, [found.parameters[name] for name in names], rtol=1e-8)
