"""Contacts that are to be expected."""

from __future__ import annotations

import numpy as np

from lariat.control.supervision.clearance_guard import ClearanceGuard, Threat
from lariat.geometry.obstacles import Obstacle

RADIUS = 0.004
LINE = np.stack([np.linspace(-0.2, 0.2, 21), *np.zeros((2, 21))], axis=1)
POST = Obstacle("sphere", (0.01, 0.1, 0.0), radius=0.02, name="post")
SURFACE = 0.1 - 0.02 - RADIUS
"""Way of the line to contact with the post [m]."""


def at(way: float) -> np.ndarray:
    """Rope after a way towards the post [m]."""
    return LINE + np.array([0.0, way, 0.0])


def threat(
    start: float,
    end: float,
    *,
    deviation: float = 0.0,
    seen: float | None = None,
    accepted: float = np.inf,
    wanted: float = 0.012,
) -> Threat | None:
    """Threat of a rope with a clearance at the start and at the end of a horizon [m]."""
    ways = SURFACE - np.linspace(start, end, 6)
    chains = np.stack([at(way) for way in ways])
    observed = chains[0] if seen is None else at(SURFACE - seen)
    guard = ClearanceGuard(RADIUS, wanted)
    return guard.check(observed, chains[0], chains[1:], deviation, (POST,), accepted)


def test_predicted_contact_is_a_threat_and_says_with_what() -> None:
    found = threat(0.03, -0.002)
    assert found is not None
    assert found.obstacle == "post"
    np.testing.assert_allclose(
        [found.clearance, found.predicted, found.lack], [0.03, -0.002, 0.005], atol=1e-5
    )


def test_rope_that_stays_clear_is_no_threat() -> None:
    assert threat(0.03, 0.004) is None


def test_half_of_a_small_wanted_clearance_is_enough() -> None:
    assert threat(0.006, 0.0015) is not None
    assert threat(0.006, 0.0015, wanted=0.002) is None
    assert threat(0.006, 0.0005, wanted=0.002) is not None


def test_clearance_is_that_of_segments() -> None:
    # Nodes lie 10 mm on either side of the nearest point of a segment to a small obstacle.
    pin = Obstacle("sphere", (0.01, 0.004, 0.0), radius=0.001, name="pin")
    guard = ClearanceGuard(RADIUS)
    away = np.array([0.0, -0.02, 0.0])
    chains = np.stack([LINE + share * away for share in (0.8, 0.6, 0.4, 0.2, 0.1)])
    found = guard.check(LINE + away, LINE + away, chains, 0.0, (pin,))
    assert found is not None
    np.testing.assert_allclose(found.predicted, 0.006 - 0.001 - RADIUS, atol=1e-5)


def test_uncertain_prediction_is_a_threat_sooner() -> None:
    assert threat(0.03, 0.008) is None
    assert threat(0.03, 0.008, deviation=0.002) is None
    assert threat(0.03, 0.008, deviation=0.004) is not None


def test_rope_that_leaves_an_obstacle_is_let_go() -> None:
    assert threat(0.001, 0.008) is None
    assert threat(-0.001, 0.002, deviation=0.004) is None


def test_rope_that_is_observed_near_contact_is_a_threat_whatever_is_predicted() -> None:
    assert threat(0.012, 0.011, seen=0.002) is not None
    assert threat(0.012, 0.011, seen=0.004) is None


def test_start_or_goal_near_an_obstacle_is_accepted() -> None:
    assert threat(0.012, 0.001) is not None
    assert threat(0.012, 0.001, accepted=0.0005) is None
    assert threat(0.012, 0.012, seen=0.0, accepted=0.001) is None
