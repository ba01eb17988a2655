from __future__ import annotations

import numpy as np

from dashboard import palette
from dashboard.scene.certainty import UNCERTAIN_SIGMA, certainty_colors
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
