"""The rod at rest against the continuum."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.physics.continuum import equilibrium
from benchmarks.physics.hanging import (
    CLAMPED_ROPES,
    MAX_MEAN_ERROR,
    MIN_ORDER,
    OTHER_ROPES,
    HeldRope,
    level_grip,
)
from lariat.geometry.poses import Pose

ROPES = (
    "0.24 m apart",
    "E / 4",
    "yawed and pitched, E / 4",
    "twisted by 2.5 rad",
    "tapered",
    "cantilever, E x 2",
    "pinned at both ends",
)
"""Ropes that are tested; `lariat bench physics` measures all."""


@pytest.mark.parametrize("name", ROPES)
def test_rest_shapes_converge_to_the_continuum_with_second_order(name: str) -> None:
    rope = (CLAMPED_ROPES | OTHER_ROPES)[name]
    coarse, middle, fine = (rope.rest_error(n) for n in (20, 40, 80))
    assert middle <= MAX_MEAN_ERROR
    assert math.log(coarse / fine) / math.log(79.0 / 19.0) >= MIN_ORDER


def test_a_clamp_that_acts_at_the_middle_of_the_first_edge_exceeds_the_bound() -> None:
    rope, node_count = CLAMPED_ROPES["0.24 m apart"], 80
    half = 0.5 * rope.rod(node_count).edge_length
    outer = replace(
        rope,
        left=Pose(rope.left.position + np.array([half, 0.0, 0.0]), rope.left.orientation),
        right=Pose(rope.right.position - np.array([half, 0.0, 0.0]), rope.right.orientation),
    )
    distances = rope.continuum.positions(node_count) - outer.rest(node_count).state.positions
    assert 1e3 * np.mean(np.linalg.norm(distances, axis=1)) > MAX_MEAN_ERROR


def test_the_continuum_of_a_stiff_cantilever_bends_like_a_beam() -> None:
    stiff = replace(OTHER_ROPES["cantilever, E x 8"].properties, youngs_modulus=1e11)
    rope = HeldRope(stiff, level_grip(0.0), level_grip(0.0), right_end="free")
    weight = stiff.linear_density * 9.81
    tip = -weight * stiff.length**4 / (8.0 * stiff.bending_stiffness)
    # Shear by the weight, at the stiffness that stretch and shear share.
    tip -= weight * stiff.length**2 / (2.0 * stiff.stretch_stiffness)
    assert rope.continuum.positions(2)[1, 2] == pytest.approx(tip, rel=1e-4)


def test_the_continuum_does_not_depend_on_the_rod_that_it_starts_from() -> None:
    rope = CLAMPED_ROPES["twisted by 2.5 rad"]
    coarse = equilibrium(rope.rod(24), *rope.grips, rope.rest(24).state)
    np.testing.assert_allclose(coarse.positions(50), rope.continuum.positions(50), atol=1e-9)
