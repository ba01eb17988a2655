"""Ropes beside the held one keep their numbers while they cross, are hidden, and move."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.perception.other_ropes.other_ropes import OtherRopes, SeenLine
from lariat.perception.rgbd.line_of_sight import Sight

FRAME = 33_000_000
Points = Float64[np.ndarray, "k 3"]


def line(x: float, y: float, yaw: float, length: float = 0.4) -> Points:
    """Straight line at a height of 0.2 m."""
    s = np.linspace(-0.5, 0.5, 60)[:, None] * length
    return np.array([x, y, 0.2]) + s * np.array([np.cos(yaw), np.sin(yaw), 0.0])


def thick(lines: list[Points], diameter: float = 0.008) -> list[SeenLine]:
    return [SeenLine(points, diameter) for points in lines]


def sight(points: Points, past: bool = False, there: bool = False) -> Sight:
    return Sight(np.full(len(points), past), np.full(len(points), there))


def after(*frames: list[Points], others: OtherRopes | None = None, start: int = 0) -> OtherRopes:
    others = others or OtherRopes()
    for number, lines in enumerate(frames):
        others.update(thick(lines), sight, (start + number) * FRAME)
    return others


def test_a_rope_is_reported_from_its_third_frame_on() -> None:
    assert [len(after(*n * [[line(0, 0, 0)]]).ropes) for n in (1, 2, 3)] == [0, 0, 1]


def test_two_ropes_that_cross_keep_their_numbers_while_one_passes() -> None:
    others = OtherRopes()
    for k in range(40):
        lines = [line(0, 0, 0), line(0.015 * k - 0.3, 0, 1.5)]
        drawn = np.concatenate(lines)

        def clear(points: Points, drawn: Points = drawn) -> Sight:
            past = np.min(polylines.point_distances(points, drawn), axis=1) > 0.01
            return Sight(past, ~past)

        others.update(thick(lines), clear, k * FRAME)
    assert [rope.id for rope in others.ropes] == [1, 2]
    assert np.ptp(others.ropes[0].points[:, 1]) < 0.01
    assert np.ptp(others.ropes[1].points[:, 1]) > 0.3


def test_a_rope_that_is_hidden_for_less_than_a_second_keeps_its_number_and_place() -> None:
    others = after(*5 * [[line(0, 0, 0)]])
    after(*27 * [[]], others=others, start=5)
    (rope,) = others.ropes
    assert not any(part.seen for part in rope.parts)
    assert rope.length == pytest.approx(0.4, abs=1e-3)
    after([line(0, 0.01, 0)], others=others, start=32)
    (rope,) = others.ropes
    assert rope.id == 1
    after(*40 * [[]], others=others, start=33)
    assert not others.ropes


def test_a_rope_is_forgotten_at_once_where_the_camera_sees_past_it() -> None:
    others = after(*5 * [[line(0, 0, 0)]])
    others.update([], partial(sight, past=True), 5 * FRAME)
    assert not others.ropes


def test_a_rope_whose_place_stays_taken_is_remembered_for_five_seconds() -> None:
    others = after(*5 * [[line(0, 0, 0)]])
    for number in range(5, 140):
        others.update([], partial(sight, there=True), number * FRAME)
    assert len(others.ropes) == 1
    others.update([], partial(sight, there=True), 170 * FRAME)
    assert not others.ropes


def test_a_hidden_half_is_remembered_beside_the_half_in_view() -> None:
    others = after(*5 * [[line(0, 0, 0)]], [line(-0.1, 0, 0, length=0.2)])
    (rope,) = others.ropes
    assert sorted(part.seen for part in rope.parts) == [False, True]
    assert rope.length == pytest.approx(0.4, abs=0.03)


def test_a_rope_that_is_covered_more_and_more_is_remembered_whole() -> None:
    others = after(*5 * [[line(0, 0, 0)]])
    for k in range(1, 26):
        after([line(-0.002 * k, 0, 0, length=0.4 - 0.004 * k)], others=others, start=4 + k)
    (rope,) = others.ropes
    assert sorted(part.seen for part in rope.parts) == [False, True]
    assert rope.length == pytest.approx(0.4, abs=0.02)
    after([line(-0.05, 0.008, 0, length=0.3)], others=others, start=30)
    assert len(rope.lines) == 1


def test_two_halves_that_turn_out_to_be_one_rope_go_on_by_the_older_number() -> None:
    halves = [line(-0.12, 0, 0, length=0.16), line(0.12, 0, 0, length=0.16)]
    others = after(*4 * [halves])
    assert len(others.ropes) == 2
    after([line(0, 0, 0)], others=others, start=4)
    (rope,) = others.ropes
    assert rope.id == 1
    assert len(rope.parts) == 1


def test_the_same_rope_in_two_images_counts_once() -> None:
    others = after(*3 * [[line(0, 0, 0), line(0.01, 0.004, 0, length=0.36)]])
    (rope,) = others.ropes
    assert rope.length == pytest.approx(0.4, abs=1e-3)


def test_the_revision_grows_when_a_rope_comes_moves_or_goes_and_not_by_noise() -> None:
    random = np.random.default_rng(0)

    def noisy(y: float) -> list[Points]:
        place = line(0, y, 0)
        return [place + 0.001 * random.normal(size=place.shape)]

    others = after(*3 * [noisy(0)])
    come = others.revision
    assert come == 2
    after(*10 * [noisy(0)], others=others, start=3)
    assert others.revision == come
    after(noisy(0.013), others=others, start=13)
    assert others.revision == come + 1
    others.forget()
    assert others.revision == come + 2
