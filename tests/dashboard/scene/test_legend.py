"""Legend of the scene."""

from __future__ import annotations

import pytest

from dashboard.scene.legend import COLORINGS, LEGEND_ENTRIES, ROPE_ENTRIES, Coloring, legend_html


@pytest.mark.parametrize("coloring", COLORINGS)
def test_shape_and_colour_together_mean_one_thing(coloring: Coloring) -> None:
    entries = (*ROPE_ENTRIES[coloring], *LEGEND_ENTRIES)
    looks = [(entry.shape, entry.color) for entry in entries]
    assert len(set(looks)) == len(looks)


@pytest.mark.parametrize("coloring", COLORINGS)
def test_what_moves_along_with_the_rope_is_told_apart_without_colour(coloring: Coloring) -> None:
    entries = (*ROPE_ENTRIES[coloring], *LEGEND_ENTRIES)
    shapes = {entry.text.split()[0]: entry.shape for entry in entries}
    assert len({shapes["rope,"], shapes["goal"], shapes["prediction"], shapes["planned"]}) == 4


def test_every_entry_is_in_the_legend_of_its_colouring() -> None:
    for coloring in COLORINGS:
        page = legend_html(coloring)
        assert all(entry.text in page for entry in LEGEND_ENTRIES)
        shown = [c for c in COLORINGS if all(e.text in page for e in ROPE_ENTRIES[c])]
        assert shown == [coloring]
