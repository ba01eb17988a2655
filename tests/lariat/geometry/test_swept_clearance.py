from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lariat.geometry.obstacles import TABLE, Obstacle, chain_clearance
from lariat.geometry.swept_clearance import swept_clearance

WALL = Obstacle("box", (0.0, 0.0, 0.5), size=(2.0, 0.01, 1.0), name="wall")
CHAIN = np.stack([np.linspace(-0.2, 0.2, 9), np.zeros(9), np.full(9, 0.3)], axis=1)


def across(y: float) -> np.ndarray:
    return CHAIN + np.array([0.0, y, 0.0])


def test_a_chain_that_jumps_over_a_thin_wall_touches_it() -> None:
    chains = np.stack([across(-0.1), across(0.11)])
    assert min(chain_clearance(c, 0.004, [WALL]) for c in chains) > 0.09
    assert swept_clearance(chains, 0.004, [WALL]) < -0.004


def test_a_chain_at_rest_has_the_clearance_of_its_shape() -> None:
    chains = np.stack([across(-0.1)] * 3)
    expected = chain_clearance(across(-0.1), 0.004, [WALL])
    assert swept_clearance(chains, 0.004, [WALL]) == pytest.approx(expected, abs=1e-9)


def test_a_segment_counts_between_its_nodes() -> None:
    post = Obstacle("cylinder", (0.025, 0.0, 0.3), radius=0.001, height=0.6, name="post")
    chains = np.stack([across(-0.03), across(0.03)])
    assert swept_clearance(chains, 0.002, [post]) < 0.0


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10**6))
def test_swept_clearance_is_that_of_many_shapes_in_between(seed: int) -> None:
    random = np.random.default_rng(seed)
    ball = Obstacle("sphere", (0.0, 0.0, 0.3), radius=0.02, name="ball")
    ends = CHAIN + random.normal(scale=0.08, size=(2, 1, 3)) + random.normal(size=(2, 9, 3)) * 0.01
    fine = [(1 - s) * ends[0] + s * ends[1] for s in np.linspace(0.0, 1.0, 100)]
    expected = min(chain_clearance(c, 0.004, [ball, WALL, TABLE]) for c in fine)
    found = swept_clearance(ends, 0.004, [ball, WALL, TABLE])
    assert expected - 1e-3 < found < expected + 0.004


def test_thickness_is_the_least_extent() -> None:
    assert WALL.thickness == 0.01
    assert TABLE.thickness == np.inf
    assert Obstacle("cylinder", (0, 0, 0), radius=0.03, height=0.02).thickness == 0.02
