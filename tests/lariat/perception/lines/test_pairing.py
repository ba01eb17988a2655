"""Pairing of the ends of fragments at crossings."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.perception.lines.fragments import EndPose
from lariat.perception.lines.pairing import FREE_END_COST, bending, cheapest_pairing

WIDTH = 10.0


def end(x: float, y: float, angle: float) -> EndPose:
    return EndPose(np.array([x, y]), np.array([np.cos(angle), np.sin(angle)]))


def test_bending_of_an_arc_is_its_turning_squared_over_its_length() -> None:
    turning, radius = 0.6, 100.0
    start = end(0.0, 0.0, 0.0)
    stop = end(radius * np.sin(turning), radius * (1.0 - np.cos(turning)), turning + np.pi)
    chord = 2.0 * radius * np.sin(turning / 2.0)
    assert bending(start, stop, WIDTH) == pytest.approx(turning**2 / (chord / WIDTH))


def test_an_s_of_the_same_slopes_bends_three_times_as_much_as_an_arc() -> None:
    slope = 0.2
    arc = bending(end(0.0, 0.0, slope), end(60.0, 0.0, np.pi - slope), WIDTH)
    s_curve = bending(end(0.0, 0.0, slope), end(60.0, 0.0, np.pi + slope), WIDTH)
    assert s_curve == pytest.approx(3.0 * arc)


def test_least_total_cost_wins_over_the_cheapest_pair() -> None:
    costs = {(0, 1): 0.05, (2, 3): 1.1, (0, 2): 0.1, (1, 3): 0.1, (0, 3): 1.0, (1, 2): 1.0}
    best, second, pairs = cheapest_pairing(
        [(k, 0) for k in range(4)], lambda a, b: costs[(a[0], b[0])]
    )
    assert {tuple(e[0] for e in p) for p in pairs} == {(0, 2), (1, 3)}
    assert best == pytest.approx(0.2)
    assert second == pytest.approx(0.05 + 1.1)


def test_an_end_without_a_straight_partner_stays_free() -> None:
    best, _, pairs = cheapest_pairing([(0, 0), (1, 0), (2, 0)], lambda a, b: 0.1 * (b[0] - a[0]))
    assert len(pairs) == 1
    assert best == pytest.approx(0.1 + FREE_END_COST)
