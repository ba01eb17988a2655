from __future__ import annotations

import numpy as np
import pytest

from dashboard import palette
from dashboard.scene.certainty import (
    MAX_BEAD_RADIUS,
    UNCERTAIN_SIGMA,
    bead_radii,
    certainty_colors,
)
from shared.messages import NodeChain


def test_certain_uncertain_and_unobserved_nodes_differ_in_colour() -> None:
    message = NodeChain(
        positions=np.zeros(9), sigma=[0.0, UNCERTAIN_SIGMA, 0.0], observed=[True, True, False]
    )
    np.testing.assert_array_equal(
        certainty_colors(message), [palette.ROPE, palette.UNCERTAIN, palette.UNOBSERVED]
    )


def test_chain_without_sigma_is_certain() -> None:
    colors = certainty_colors(NodeChain(positions=np.zeros(6)))
    np.testing.assert_array_equal(colors, [palette.ROPE, palette.ROPE])


def test_bead_is_two_standard_deviations_where_that_is_more_than_the_rope() -> None:
    rope = NodeChain(positions=np.zeros(12), sigma=[0.001, 0.003, 0.01, 1.0])
    assert bead_radii(rope, 0.004) == pytest.approx([0.004, 0.006, 0.02, MAX_BEAD_RADIUS])
    assert bead_radii(NodeChain(positions=np.zeros(6)), 0.004) == pytest.approx([0.004, 0.004])
