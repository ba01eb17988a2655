"""Legend of the scene."""

from __future__ import annotations

from dashboard.scene.legend import LEGEND_ENTRIES, legend_html


def test_shape_and_colour_together_mean_one_thing() -> None:
    looks = [(entry.shape, entry.color) for entry in LEGEND_ENTRIES]
    assert len(set(looks)) == len(looks)


def test_what_moves_along_with_the_rope_is_told_apart_without_colour() -> None:
    shapes = {entry.text.split()[0]: entry.shape for entry in LEGEND_ENTRIES}
    assert len({shapes["rope,"], shapes["goal"], shapes["prediction"], shapes["planned"]}) == 4


def test_every_entry_is_in_the_legend() -> None:
    page = legend_html()
    assert all(entry.text in page for entry in LEGEND_ENTRIES)
