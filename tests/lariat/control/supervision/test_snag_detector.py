"""Detection of a rope that stays behind the model, or is taut where the model is not."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.control.supervision.snag_detector import Snag, SnagDetector

PERIOD = 100_000_000
LENGTH = 0.45
X = np.linspace(-0.15, 0.15, 13)
REST = np.stack([X, np.zeros(13), 0.3 - 0.12 * (1.0 - (X / 0.15) ** 2)], axis=1)
SEEN = np.ones(13, dtype=bool)


def observe(
    detector: SnagDetector,
    shapes: list[tuple[np.ndarray, np.ndarray]],
    observed: np.ndarray = SEEN,
    length: float = LENGTH,
    *,
    leaning: bool = False,
) -> list[Snag | None]:
    """Results of observations of rope and model, one period apart."""
    return [
        detector.observe(k * PERIOD, nodes, model, observed, length, leaning=leaning)
        for k, (nodes, model) in enumerate(shapes)
    ]


def moving(count: int, behind: slice) -> list[tuple[np.ndarray, np.ndarray]]:
    """Rope and model that move by 2 cm in each period, without some of the rope's nodes."""
    shapes = []
    for k in range(count):
        model = REST + np.array([0.0, 0.02 * k, 0.0])
        nodes = model.copy()
        nodes[behind] = REST[behind]
        shapes.append((nodes, model))
    return shapes


def test_rope_that_follows_the_model_has_no_snag() -> None:
    assert observe(SnagDetector(), moving(12, slice(0, 0))) == [None] * 12


def test_nodes_that_stay_behind_are_a_snag_after_four_observations_of_the_window() -> None:
    found = observe(SnagDetector(), moving(9, slice(5, 8)))
    # The window takes 4 periods, and its sign must last for 4 observations.
    assert [snag is not None for snag in found] == [False] * 7 + [True] * 2
    assert found[7] is not None
    assert found[7].sign == "stays_behind"
    np.testing.assert_array_equal(found[7].position, REST[6])


def test_nodes_that_friction_holds_on_a_support_are_no_snag() -> None:
    found = observe(SnagDetector(), moving(12, slice(5, 8)), leaning=True)
    assert {snag.sign for snag in found if snag} == {"taut"}


def test_two_adjacent_nodes_that_stay_behind_are_no_snag() -> None:
    assert not any(observe(SnagDetector(), moving(12, slice(5, 7))))


def test_nodes_that_follow_with_half_the_motion_are_no_snag() -> None:
    shapes = [(0.5 * (rope + model), model) for rope, model in moving(12, slice(5, 8))]
    assert not any(observe(SnagDetector(), shapes))


def test_nodes_that_wait_where_the_model_comes_to_them_are_no_snag() -> None:
    # A model that is behind the rope catches up with it.
    shapes = []
    for model in (REST + np.array([0.0, 0.02 * k, 0.0]) for k in range(12)):
        nodes = model.copy()
        nodes[5:8] = REST[5:8] + np.array([0.0, 0.24, 0.0])
        shapes.append((nodes, model))
    assert not any(observe(SnagDetector(), shapes, length=1.0))


def test_bridged_nodes_are_no_snag() -> None:
    hidden = SEEN.copy()
    hidden[6] = False
    assert not any(observe(SnagDetector(), moving(12, slice(5, 8)), hidden))


def test_reset_drops_all_signs() -> None:
    detector = SnagDetector()
    shapes = moving(9, slice(5, 8))
    observe(detector, shapes[:7])
    detector.reset()
    assert detector.observe(7 * PERIOD, *shapes[7], SEEN, LENGTH) is None


@pytest.mark.parametrize(("height", "found"), [(0.167, True), (0.155, False)])
def test_rope_drawn_tight_round_a_point_is_a_snag(height: float, found: bool) -> None:
    # With a distance of 0.3 m between the grips, a peak of 0.167 m makes both lines 0.449 m long.
    tight = REST.copy()
    tight[:, 2] = 0.3 + height * (1.0 - np.abs(X) / 0.15)
    tight[5], tight[7] = tight[6], tight[6]
    snags = observe(SnagDetector(), [(tight, REST)] * 4)
    assert [snag is not None for snag in snags] == [False] * 3 + [found]
    if found:
        assert snags[3] is not None
        assert snags[3].sign == "taut"
        np.testing.assert_array_equal(snags[3].position, tight[6])


def test_rope_that_is_taut_where_the_model_is_taut_has_no_snag() -> None:
    line = REST.copy()
    line[:, 0], line[:, 2] = np.linspace(-0.2245, 0.2245, 13), 0.3
    assert not any(observe(SnagDetector(), [(line, line)] * 6))


@pytest.mark.parametrize(("length", "found"), [(LENGTH, True), (1.01 * LENGTH, False)])
def test_rope_is_taut_by_the_length_that_is_known_by_now(length: float, found: bool) -> None:
    tight = REST.copy()
    tight[:, 2] = 0.3 + 0.167 * (1.0 - np.abs(X) / 0.15)
    tight[5], tight[7] = tight[6], tight[6]
    snags = observe(SnagDetector(), [(tight, REST)] * 4, length=length)
    assert (snags[3] is not None) == found
