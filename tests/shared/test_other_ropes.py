"""Capsules around the ropes beside the held one."""

from __future__ import annotations

import numpy as np

from lariat.geometry.obstacles import scene_distance
from shared.messages import OtherRope, OtherRopes, RopeLine
from shared.other_ropes import MAX_CHORD_ERROR, other_rope_obstacles

ANGLE = np.linspace(0.0, 2.5, 40)
ARC = np.stack([0.15 * np.cos(ANGLE), 0.15 * np.sin(ANGLE), 0.2 + 0.02 * ANGLE], axis=1)


def message(*lines: np.ndarray) -> OtherRopes:
    parts = [RopeLine(positions=line.ravel()) for line in lines]
    return OtherRopes(ropes=[OtherRope(id=7, lines=parts, diameter=0.01)])


def test_a_bent_rope_lies_in_few_capsules_that_are_little_thicker() -> None:
    capsules = other_rope_obstacles(message(ARC))
    assert len(capsules) <= 10
    assert {o.name for o in capsules} == {"other rope 7"}
    inside = scene_distance(ARC, capsules)
    assert np.all(inside < -0.005 + 1e-9)
    assert np.all(inside > -0.0066)


def test_ends_are_round_and_every_line_is_covered() -> None:
    other = ARC + np.array([0.0, 0.0, 0.1])
    capsules = other_rope_obstacles(message(ARC, other))
    beyond = ARC[-1] + 0.02 * (ARC[-1] - ARC[-2]) / np.linalg.norm(ARC[-1] - ARC[-2])
    expected = 0.02 - 0.005 - MAX_CHORD_ERROR
    np.testing.assert_allclose(scene_distance(beyond, capsules), expected, atol=1e-6)
    assert np.max(scene_distance(other, capsules)) < 0.0


def test_a_line_of_one_place_is_a_sphere() -> None:
    (ball,) = other_rope_obstacles(message(np.array([[0.1, 0.2, 0.3], [0.1, 0.2, 0.3]])))
    assert ball.shape == "sphere"


def test_a_cell_without_other_ropes_has_no_capsules() -> None:
    assert other_rope_obstacles(OtherRopes()) == ()
