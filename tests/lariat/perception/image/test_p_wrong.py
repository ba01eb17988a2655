"""Ropes that are kept though where they lead to is doubtful."""

from __future__ import annotations

from dataclasses import replace

from lariat.perception.image.p_wrong import (
    DROPPED_LOG_ODDS,
    SEEN_LOG_ODDS,
    RopeFeatures,
    believed,
    log_odds,
)

SURE = RopeFeatures(
    length=4.0,
    unevenness=0.05,
    worst_pair=0.1,
    ambiguity=0.0,
    loose_ends=0.0,
    contrast=4.0,
    hidden=0.05,
    shadow=0.0,
    unseen=-3.9,
    narrowing=0.02,
)


def test_a_rope_with_a_doubtful_crossing_is_kept_if_the_network_surely_sees_it() -> None:
    crossed = replace(SURE, ambiguity=1.0, loose_ends=2.0, worst_pair=1.4)
    assert log_odds(crossed) > DROPPED_LOG_ODDS
    assert believed([SURE, crossed]) == [0, 1]
    assert believed([SURE, replace(crossed, unseen=1.0 - SEEN_LOG_ODDS)]) == [0]


def test_a_short_uneven_region_is_dropped_though_the_network_sees_it_but_not_a_long_one() -> None:
    uneven = replace(SURE, unevenness=0.5, loose_ends=1.0, length=3.4)
    assert log_odds(uneven) > DROPPED_LOG_ODDS
    assert believed([SURE, uneven]) == [0]
    assert believed([SURE, replace(uneven, length=4.3)]) == [0, 1]


def test_a_short_faint_uneven_piece_is_dropped_but_not_a_long_even_or_clear_one() -> None:
    edge = replace(SURE, length=3.3, unevenness=0.25, unseen=0.0)
    assert believed([SURE, edge]) == [0]
    assert believed([SURE, replace(edge, length=5.0)]) == [0, 1]
    assert believed([SURE, replace(edge, unevenness=0.15)]) == [0, 1]
    assert believed([edge]) == [0]
