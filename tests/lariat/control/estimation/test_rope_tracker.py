"""The tracker takes what is an observation of its rope, and begins anew where the grips jump."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.control.estimation.material_filter import MaterialFilter
from lariat.control.estimation.rope_observation import RopeObservation
from lariat.control.estimation.rope_tracker import MAX_GAP, MAX_P_WRONG, RopeTracker
from lariat.control.estimation.state_estimator import StateEstimator
from lariat.rod import Rod
from lariat.trajectory import SECOND, MotionState
from tests.services.controller.cell import COUNT, PROPERTIES, grips

HELD = MotionState.at_rest(*grips((-0.19, 0.0, 0.3), (0.19, 0.0, 0.3)))
APART = MotionState.at_rest(*grips((-0.3, 0.0, 0.3), (0.3, 0.0, 0.3)))


@pytest.fixture
def tracker() -> RopeTracker:
    estimator = StateEstimator(Rod(PROPERTIES, COUNT), HELD, 0)
    tracker = RopeTracker(estimator, MaterialFilter(PROPERTIES), turns=0)
    assert not tracker.advance(HELD, SECOND, 1)
    assert tracker.begin(HELD, SECOND)
    return tracker


def take(tracker: RopeTracker, seen: RopeObservation) -> RopeObservation | None:
    return tracker.observe(seen, 2 * SECOND, adapts=False, resting=True, following=False)


def seen_by(tracker: RopeTracker) -> RopeObservation:
    nodes = tracker.estimator.nodes
    return RopeObservation(SECOND, nodes, np.zeros(COUNT), np.ones(COUNT, dtype=bool))


def test_lost_doubtful_early_and_other_ropes_are_no_observation(tracker: RopeTracker) -> None:
    seen = seen_by(tracker)
    doubtful = replace(seen, p_wrong=2.0 * MAX_P_WRONG)
    assert take(tracker, doubtful) is None
    assert tracker.p_wrong == doubtful.p_wrong
    assert take(tracker, replace(doubtful, nodes=np.zeros((0, 3)))) is None
    assert tracker.p_wrong == 0.0
    assert take(tracker, replace(seen, stamp=SECOND - 1)) is None
    assert take(tracker, replace(seen, nodes=seen.nodes[1:])) is None
    assert tracker.last_seen is None
    assert take(tracker, seen) is seen
    assert (tracker.last_seen, tracker.image_stamp) == (2 * SECOND, SECOND)


def test_an_image_older_than_what_is_kept_of_the_motion_is_no_observation(
    tracker: RopeTracker,
) -> None:
    """Compared with grips that have moved on since, its rope would seem to have left them."""
    seen, kept = seen_by(tracker), tracker.estimator.settings.history_time
    moved = HELD
    for k in range(1, 11):
        moved = MotionState.at_rest(
            *grips((-0.19, 0.0, 0.3 + 0.01 * k), (0.19, 0.0, 0.3 + 0.01 * k))
        )
        assert tracker.advance(moved, SECOND + int(0.1 * k * kept * 1.2 * SECOND), 1)
    assert take(tracker, seen) is None
    assert take(tracker, replace(seen, stamp=tracker.estimator.oldest)) is not None


def test_bridged_nodes_are_no_sight_of_the_rope(tracker: RopeTracker) -> None:
    seen = replace(seen_by(tracker), observed=np.zeros(COUNT, dtype=bool))
    assert take(tracker, seen) is seen
    assert tracker.last_seen is None
    np.testing.assert_allclose(tracker.observed, seen.nodes, atol=1e-12)


def test_estimate_begins_anew_after_a_reset_a_gap_and_a_fault(tracker: RopeTracker) -> None:
    assert tracker.advance(HELD, SECOND + 1, 1)
    assert not tracker.advance(HELD, SECOND + 2, 2)
    assert tracker.begin(HELD, SECOND + 2)
    assert not tracker.advance(HELD, SECOND + 2 + MAX_GAP, 2)
    tracker.forget()
    assert not tracker.advance(HELD, SECOND + 3, 2)


def test_grips_beyond_the_reach_of_the_rope_are_a_problem_until_they_come_together(
    tracker: RopeTracker,
) -> None:
    assert not tracker.begin(APART, 2 * SECOND)
    assert "grips" in tracker.problem
    assert not tracker.advance(APART, 2 * SECOND + 1, 1)
    assert tracker.begin(HELD, 3 * SECOND)
    assert tracker.problem == ""
