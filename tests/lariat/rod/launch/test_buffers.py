"""Buffers of successive launches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry.obstacles import Obstacle, pack
from lariat.rod import Rod, RodProperties, RolloutSpec
from lariat.rod.integration_schemes import Scheme
from lariat.rod.model import End


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


@pytest.mark.parametrize("scheme", ["euler", "sdirk2"])
@pytest.mark.parametrize("ends", [("clamped", "clamped"), ("clamped", "free"), ("free", "pinned")])
def test_what_lay_in_memory_before_a_launch_has_no_effect(
    scheme: Scheme, ends: tuple[End, End]
) -> None:
    properties = RodProperties(0.45, 0.008, 0.044, 1e6, internal_damping=0.01)
    clean, dirty = (Rod(properties, 12, *ends, scheme=scheme) for _ in range(2))
    state = clean.straight((0.0, 0.0, 0.3), (1.0, 0.0, 0.3))
    blocks = np.array([0, 0, 1, 2, 2])
    spec = RolloutSpec(state, np.full((3, 2, 6), 0.05), 0.02, block_of_step=blocks)
    cost = np.ones((5, 12, 3))
    found = []
    for rod, content in ((clean, 0.0), (dirty, np.nan)):
        rod._pool._doubles = np.full(1_000_000, content)
        linearization = rod.linearize(spec, ("length", "internal_damping"))
        gradient = rod.gradient(spec, cost, ("length", "internal_damping"))
        found.append(
            (
                linearization.d_positions_d_actions,
                linearization.d_positions_d_parameters,
                gradient.actions,
                gradient.rollout.positions,
            )
        )
    for there, here in zip(*found, strict=True):
        np.testing.assert_array_equal(here, there)
