"""Judge of lines: what is no rope, and what is none that is whole."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lariat.perception.image.p_wrong import (
    RopeFeatures,
    image_features,
    p_background,
    p_wrong,
)

SURE = RopeFeatures(
    length=4.0,
    unevenness=0.05,
    ambiguity=0.0,
    loose_ends=0.0,
    contrast=4.0,
    hidden=0.02,
    shadow=0.0,
    unseen=-3.9,
    at_border=0.0,
    cut_off=0.0,
    relative_width=0.0,
)


def test_a_sure_rope_is_no_background_and_right() -> None:
    assert p_background(SURE) < 0.1
    assert p_wrong(SURE) < 0.1


@pytest.mark.parametrize("change", [{"at_border": 1.0}, {"hidden": 0.6}, {"unseen": 2.0}])
def test_borders_and_what_is_hardly_seen_are_likelier_background(change: dict[str, float]) -> None:
    assert p_background(replace(SURE, **change)) > p_background(SURE)


def test_a_short_line_is_likelier_a_rope_where_the_border_cuts_it_off() -> None:
    short = replace(SURE, length=2.0)
    assert p_background(replace(short, cut_off=1.0)) < 0.5 * p_background(short)


@pytest.mark.parametrize("change", [{"unevenness": 0.6}, {"loose_ends": 2.0}, {"hidden": 0.4}])
def test_a_rope_is_doubtful_where_it_is_uneven_cut_or_bridged(change: dict[str, float]) -> None:
    changed = replace(SURE, **change)
    assert p_wrong(changed) > 2.0 * p_wrong(SURE)
    one, other = (p_wrong(image_features([r], [], 1, 0.0)) for r in (SURE, changed))
    assert other > one
