from __future__ import annotations

import numpy as np

from lariat.geometry import polylines, poses

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


def helix(count: int) -> np.ndarray:
    """Points at equal distances on a helix of radius 0.05 m and length 0.45 m [m]."""
    turn = np.linspace(0.0, 0.45 / 0.06, count)
    return np.stack([0.05 * np.cos(turn), 0.05 * np.sin(turn), np.sqrt(0.0011) * turn], axis=1)


def test_smooth_resampling_converges_in_third_order_where_a_polyline_cuts_corners() -> None:
    exact = helix(88)
    coarse, fine = (
        np.max(np.linalg.norm(polylines.resample_smooth(helix(n), 88) - exact, axis=1))
        for n in (20, 39)
    )
    assert np.log2(coarse / fine) > 2.8
    assert fine < 2e-5
    assert np.max(np.linalg.norm(polylines.resample(helix(39), 88) - exact, axis=1)) > 2e-4


def test_smooth_resampling_returns_the_nodes_that_a_finer_chain_shares() -> None:
    fine = helix(88)
    np.testing.assert_allclose(polylines.resample_smooth(fine, 30), fine[::3], atol=2e-6)
    np.testing.assert_allclose(polylines.resample_smooth(fine, 88), fine, atol=2e-6)


def test_smooth_resampling_finds_equal_arc_lengths_between_uneven_nodes() -> None:
    uneven = helix(400)[np.unique(np.round(399.0 * np.linspace(0.0, 1.0, 60) ** 1.3).astype(int))]
    found = polylines.resample_smooth(uneven, 30)
    np.testing.assert_allclose(found, helix(30), atol=5e-5)


def test_smooth_resampling_of_a_straight_or_doubled_chain_is_exact() -> None:
    ends = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.4]])
    expected = np.linspace(*ends, 6)
    np.testing.assert_allclose(polylines.resample_smooth(ends, 6), expected, atol=1e-15)
    np.testing.assert_allclose(
        polylines.resample_smooth(ends[[0, 0, 1, 1]], 6), expected, atol=1e-15
    )


def test_end_tangents_are_those_of_the_curve_and_not_of_its_outer_edges() -> None:
    exact = np.diff(helix(200_001), axis=0)[[0, -1]]
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    fine = helix(118)
    np.testing.assert_allclose(polylines.end_tangents(fine), exact, atol=2e-3)
    outer = (fine[1] - fine[0]) / np.linalg.norm(fine[1] - fine[0])
    assert np.linalg.norm(outer - exact[0]) > 0.02


def test_point_distances_are_those_of_every_pair() -> None:
    found = polylines.point_distances(CORNER, CORNER[:2])
    np.testing.assert_allclose(found, [[0.0, 3.0], [3.0, 0.0], [np.sqrt(10.0), 1.0]])
    np.testing.assert_allclose(polylines.least_distances(CORNER, CORNER[:2]), [0.0, 0.0, 1.0])


def test_end_angles_of_an_arc_are_those_of_its_tangents() -> None:
    at = np.linspace(0.0, 1.2, 40)
    arc = np.stack([np.sin(at), 1.0 - np.cos(at), 0.0 * at], axis=1)
    # Frames whose z axes lie in the plane of the arc, 0.1 rad before its ends.
    level = np.array([0.5, 0.5, 0.5, 0.5])
    turns = [poses.exponential(np.array([0.0, 0.0, a])) for a in (0.1, 1.1)]
    frames = np.stack([poses.multiply(turn, level) for turn in turns])
    np.testing.assert_allclose(polylines.end_angles(arc, frames), [0.1, 0.1], atol=1e-3)
    np.testing.assert_array_equal(np.flatnonzero(polylines.ends_of(7)), [0, 6])
