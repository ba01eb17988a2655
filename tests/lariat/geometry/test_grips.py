from __future__ import annotations

import numpy as np

from lariat.geometry import poses
from lariat.geometry.grips import Grips


def test_steps_lead_from_each_place_to_the_next() -> None:
    random = np.random.default_rng(0)
    places = Grips(random.normal(size=(5, 2, 3)), poses.normalized(random.normal(size=(5, 2, 4))))
    steps = places.steps()
    np.testing.assert_allclose(places.positions[:-1] + steps[..., :3], places.positions[1:])
    turned = poses.multiply(poses.exponential(steps[..., 3:]), places.orientations[:-1])
    same = np.abs(np.sum(turned * places.orientations[1:], axis=-1))
    np.testing.assert_allclose(same, 1.0)


def test_places_are_taken_out_and_put_together_again() -> None:
    random = np.random.default_rng(1)
    places = Grips(random.normal(size=(4, 2, 3)), random.normal(size=(4, 2, 4)))
    pairs = Grips.of(*(places.pair(k) for k in range(4)))
    joined = Grips.joined(places[:1], places[1:])
    for again in (pairs, joined):
        assert len(again) == 4
        assert np.array_equal(again.positions, places.positions)
        assert np.array_equal(again.orientations, places.orientations)
