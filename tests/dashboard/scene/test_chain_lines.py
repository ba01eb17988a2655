from __future__ import annotations

import numpy as np

from dashboard import palette
from dashboard.scene.chain_lines import chain_segments


def test_segments_join_neighbouring_nodes_of_one_chain() -> None:
    chains = np.random.default_rng(0).normal(size=(2, 4, 3))
    segments, _ = chain_segments(chains, np.ones(2), palette.PATH)
    assert segments.shape == (6, 2, 3)
    np.testing.assert_array_equal(segments[3:, 0], chains[1, :-1])
    np.testing.assert_array_equal(segments[3:, 1], chains[1, 1:])


def test_weight_fades_from_the_colour_of_the_table_to_that_of_the_chain() -> None:
    chains = np.zeros((2, 2, 3))
    _, colors = chain_segments(chains, np.array([0.0, 1.0]), palette.PATH)
    np.testing.assert_array_equal(colors[0], [palette.linear(palette.TABLE)] * 2)
    np.testing.assert_array_equal(colors[1], [palette.linear(palette.PATH)] * 2)
