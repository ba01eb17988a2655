"""Buffers of successive launches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lariat.geometry.obstacles import Obstacle, pack
from lariat.rod import Rod, RodProperties, RolloutSpec


def test_a_launch_does_not_depend_on_the_one_before() -> None:
    properties = RodProperties(0.45, 0.008, 0.044, 1e6)
    bar = Obstacle("sphere", (0.2, 0.0, 0.28), radius=0.02)
    rod = Rod(properties, 12)
    state = rod.straight((0.0, 0.0, 0.3), (1.0, 0.0, 0.3))
    spec = RolloutSpec(state, np.full((3, 2, 6), 0.05), 0.02, obstacles=pack([bar]))
    lower = pack([replace(bar, position=(0.2, 0.0, 0.2))])
    softer = rod.with_properties(replace(properties, youngs_modulus=1e5))
    for other, changed in (
        (softer, spec),
        (rod, replace(spec, dt=0.01)),
        (rod, replace(spec, obstacles=lower)),
    ):
        expected = Rod(other.properties, 12).rollout(changed).positions
        rod.rollout(spec)
        np.testing.assert_array_equal(other.rollout(changed).positions, expected)
    cost = np.ones((3, 12, 3))
    expected_gradient = Rod(properties, 12).gradient(spec, cost, ("length",)).actions
    rod.gradient(spec, cost, ("damping",))
    np.testing.assert_array_equal(rod.gradient(spec, cost, ("length",)).actions, expected_gradient)
