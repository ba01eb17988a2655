from __future__ import annotations

import numpy as np
import pytest

from lariat.safety.constraints.spacing import body_spacing_slack, grip_distances
from lariat.safety.constraints.sphere_distance import Spheres, sphere_distances


def spheres(*centres: tuple[float, float, float], radius: float = 0.01) -> Spheres:
    return Spheres(np.array([centres]), np.full(len(centres), radius))


def test_grips_are_as_far_apart_as_their_positions() -> None:
    positions = np.array([[[0.0, 0.0, 0.0], [0.3, 0.4, 0.0]], [[0.0, 0.0, 0.0], [0.0, 0.0, 0.02]]])
    np.testing.assert_allclose(grip_distances(positions), [0.5, 0.02])


@pytest.mark.parametrize("slack", [0.1, 0.0, -0.02], ids=["kept", "boundary", "broken"])
def test_bodies_keep_their_distance(slack: float) -> None:
    left, right = spheres((0.0, 0.0, 0.0)), spheres((0.025 + slack, 0.0, 0.0))
    np.testing.assert_allclose(body_spacing_slack(left, right, 0.005), [slack], atol=1e-15)


def test_nearest_pair_of_spheres_counts() -> None:
    left = spheres((0.0, 0.0, 0.0), (0.0, 0.0, 0.3))
    right = spheres((0.5, 0.0, 0.0), (0.1, 0.0, 0.3), radius=0.02)
    np.testing.assert_allclose(sphere_distances(left, right), [0.07])


def test_joined_spheres_are_those_of_all_parts() -> None:
    joined = Spheres.joined([spheres((0.0, 0.0, 0.0)), spheres((1.0, 0.0, 0.0), radius=0.1)])
    assert joined.centres.shape == (1, 2, 3)
    np.testing.assert_array_equal(joined.radii, [0.01, 0.1])


def test_end_without_a_body_is_infinitely_far_away() -> None:
    nothing = Spheres(np.zeros((3, 0, 3)), np.zeros(0))
    assert np.all(np.isinf(sphere_distances(nothing, nothing)))
