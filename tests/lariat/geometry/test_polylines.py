from __future__ import annotations

import numpy as np

from lariat.geometry import polylines

CORNER = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 1.0, 0.0]])


def test_length_is_that_of_the_edges() -> None:
    np.testing.assert_array_equal(polylines.arc_lengths(CORNER), [0.0, 3.0, 4.0])
    assert polylines.length(CORNER) == 4.0


def test_resampled_nodes_are_evenly_spaced_along_the_chain() -> None:
    found = polylines.resample(CORNER, 5)
    np.testing.assert_allclose(found[:, :2], [[0, 0], [1, 0], [2, 0], [3, 0], [3, 1]])


def test_midpoints_follow_the_nodes() -> None:
    found = polylines.with_midpoints(CORNER)
    np.testing.assert_array_equal(found[:3], CORNER)
    np.testing.assert_array_equal(found[3:], [[1.5, 0.0, 0.0], [3.0, 0.5, 0.0]])


def test_mean_node_distance_of_a_shifted_chain_is_the_shift() -> None:
    assert polylines.mean_node_distance(CORNER, CORNER + np.array([0.0, 0.3, 0.4])) == 0.5


def test_end_tangents_of_an_arc_are_of_second_order() -> None:
    errors = []
    for count in (20, 40):
        angles = np.linspace(0.0, 1.5, count)
        arc = np.stack([np.sin(angles), np.zeros(count), 1.0 - np.cos(angles)], axis=1)
        first, last = polylines.end_tangents(arc)
        ends = np.array([[1.0, 0.0, 0.0], [np.cos(1.5), 0.0, np.sin(1.5)]])
        errors.append(np.max(np.abs(np.stack([first, last]) - ends)))
    assert errors[1] < 0.3 * errors[0] < 1e-3
