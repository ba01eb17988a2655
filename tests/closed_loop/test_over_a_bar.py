"""Contact on purpose: a rope is laid over a bar, and touches nothing else."""

from __future__ import annotations

import pytest

from lariat.geometry.obstacles import chain_clearance
from shared import topics
from shared.messages import chain
from stack.simulation.closed_loop import RunOutcome
from tests.closed_loop.loop import run


@pytest.fixture(scope="module")
def outcome() -> RunOutcome:
    return run("over-a-bar", "run.time_limit=6.0")


def test_the_rope_comes_to_lie_on_the_bar(outcome: RunOutcome):
    score = outcome.score
    assert score.reached, outcome.reason
    truth = outcome.stack.latest(topics.ROPE_TRUTH)
    assert truth is not None
    scenario = outcome.scorer.scenario
    bar = [o for o in scenario.bodies if o.support]
    gap = chain_clearance(chain(truth.positions), scenario.rope.diameter / 2.0, bar)
    assert -1e-3 < gap < 1e-3


def test_contact_with_the_bar_is_no_harm_and_the_post_is_kept_away_from(outcome: RunOutcome):
    score = outcome.score
    assert score.contact_time_s == 0.0
    assert score.min_clearance_mm is not None
    assert score.min_clearance_mm > 5.0
