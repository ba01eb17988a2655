from __future__ import annotations

import numpy as np
import pytest

from dashboard import palette
from dashboard.scene.chain_lines import chain_segments, dashed


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


def test_dashes_cover_half_of_a_line_in_pieces() -> None:
    points = np.linspace([0.0, 0.0, 0.0], [0.1, 0.0, 0.0], 101)
    segments = dashed(points)
    covered = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum()
    assert covered == pytest.approx(0.05, abs=0.003)
    middles = segments.mean(axis=1)[:, 0]
    assert np.count_nonzero(np.diff(middles) > 0.005) == 4
