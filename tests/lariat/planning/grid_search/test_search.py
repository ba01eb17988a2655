from __future__ import annotations

import numpy as np

from lariat.planning.grid_search.search import block_displacements


def test_every_waypoint_is_passed_and_long_legs_get_more_blocks() -> None:
    corners = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.4], [0.1, 0.0, 0.4], [0.1, 0.5, 0.4]])
    grips = np.stack([corners, corners + np.array([0.3, 0.0, 0.0])], axis=1)
    moved = block_displacements(grips, 12)
    places = np.concatenate([np.zeros((1, 3)), np.cumsum(moved[:, 0], axis=0)])
    for corner in corners:
        assert np.min(np.linalg.norm(places - corner, axis=1)) < 1e-12
    assert np.linalg.norm(moved, axis=2).max() <= 0.1 + 1e-12


def test_displacements_of_more_waypoints_than_blocks_end_at_the_last_waypoint() -> None:
    grips = np.random.default_rng(0).normal(size=(20, 2, 3))
    assert np.allclose(block_displacements(grips, 6).sum(axis=0), grips[-1] - grips[0])
