"""Grips whose rope at rest gives a part of itself a wanted shape."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import polylines, poses
from lariat.geometry.poses import Pose
from lariat.rod import Rod
from lariat.rod.part_fit import fit_part, part_points
from lariat.scenario import load
from lariat.scenario.rod_properties import rod_properties


@pytest.mark.parametrize("name", ["three-cylinders", "cable", "two-turns"])
@pytest.mark.parametrize("seed", [11, 14])
def test_part_of_a_finer_rope_at_rest_is_met(name: str, seed: int) -> None:
    # Ends that do not rotate, one end that is fixed, and ends that rotate.
    scenario = load(name)
    length, moves = scenario.rope.length, scenario.moves
    rod = Rod(rod_properties(scenario.rope), scenario.rope.node_count)
    finer = Rod(rod_properties(scenario.rope), 3 * scenario.rope.node_count - 2)
    start = scenario.grips(scenario.start)
    random = np.random.default_rng(seed)
    hidden = []
    for here, there, free in zip(start, scenario.grips(scenario.goal), moves, strict=True):
        shift = random.uniform(-0.05, 0.05, 3) * free[:3]
        turn = poses.exponential(random.uniform(-0.4, 0.4, 3) * free[3:])
        origin = there.position if free[:3].any() else here.position
        held = there.orientation if free[3:].any() else here.orientation
        hidden.append(Pose(origin + shift, poses.multiply(turn, held)))
    dense = polylines.resample_smooth(finer.rest(*hidden).state.positions, 600)
    part = (0.25 * length, 0.6 * length)
    points, counted = part_points(
        dense[polylines.within(dense, *part)], part, rod.node_count, length
    )
    fit = fit_part(rod, start, moves, points, counted)
    reached = rod.rest(*fit.grips, guess=fit.state).state.positions
    assert polylines.mean_node_distance(reached[counted], points) < 4e-4
    for grip, given, free in zip(fit.grips, start, moves, strict=True):
        assert free[:3].any() or np.array_equal(grip.position, given.position)
        assert free[3:].any() or np.array_equal(grip.orientation, given.orientation)


def test_points_of_a_part_lie_at_the_places_of_its_nodes() -> None:
    shape = np.array([[0.1, 0.0, 0.0], [0.2, 0.0, 0.0], [0.3, 0.0, 0.0]])
    points, counted = part_points(shape, (0.1, 0.3), 11, 0.5)
    assert np.flatnonzero(counted).tolist() == [2, 3, 4, 5, 6]
    assert points[:, 0] == pytest.approx([0.1, 0.15, 0.2, 0.25, 0.3])


def test_shape_that_no_rope_takes_is_left_with_its_distance() -> None:
    scenario = load("three-cylinders")
    rod = Rod(rod_properties(scenario.rope), scenario.rope.node_count)
    length = scenario.rope.length
    upright = np.stack([np.zeros(20), np.zeros(20), 0.2 + np.linspace(0.0, 0.2, 20)], axis=1)
    zigzag = upright + 0.04 * np.array([1.0, 0.0, 0.0]) * (np.arange(20) % 4 < 2)[:, None]
    points, counted = part_points(zigzag, (0.1, 0.3), rod.node_count, length)
    fit = fit_part(rod, scenario.grips(scenario.start), scenario.moves, points, counted)
    assert fit.error > 0.005
