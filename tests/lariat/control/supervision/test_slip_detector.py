"""Detection of a rope whose end has left its grip."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.control.supervision.slip_detector import Slip, SlipDetector

REST = np.linspace([-0.2, 0.0, 0.3], [0.2, 0.0, 0.3], 9)
GRIPS = REST[[0, -1]]
SEEN = np.ones(9, dtype=bool)


def observe(nodes: np.ndarray, observed: np.ndarray = SEEN, count: int = 4) -> Slip | None:
    """Result of the last of some equal observations."""
    detector = SlipDetector()
    return [detector.observe(nodes, observed, GRIPS) for _ in range(count)][-1]


@pytest.mark.parametrize(("node", "side"), [(0, "left"), (-1, "right")])
def test_end_that_is_seen_away_from_its_grip_has_slipped(node: int, side: str) -> None:
    nodes = REST.copy()
    nodes[node] += [0.0, 0.0, -0.05]
    found = observe(nodes)
    assert found is not None
    assert (found.side, round(found.distance, 6)) == (side, 0.05)
    assert observe(nodes, count=3) is None


def test_ends_near_their_grips_have_not_slipped() -> None:
    assert observe(REST + np.array([0.0, 0.0, 0.02])) is None


def test_end_that_is_not_seen_is_no_slip() -> None:
    nodes, hidden = REST.copy(), SEEN.copy()
    nodes[0] -= 0.1
    hidden[0] = False
    assert observe(nodes, hidden) is None


def test_end_that_comes_back_has_not_slipped() -> None:
    detector, away = SlipDetector(), REST - 0.1
    assert [detector.observe(n, SEEN, GRIPS) for n in (away, away, away, REST, away)] == [None] * 5
