"""Detection of ropes in images of an unknown camera."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.perception.image import detector
from lariat.perception.image.p_wrong import DOUBTFUL
from lariat.perception.lines.segmentation import Color
from tests.lariat.perception.lines.test_segmentation import GREY, ORANGE, WOOD, taken
from tests.services.perception.pictures import CableAppearance, random_axis, render_photograph
from tests.services.perception.scenes import CAMERA, curve

WHITE: Color = (235, 235, 230)


def axis_errors(
    lines: list[np.ndarray], nodes: Float64[np.ndarray, "n 3"]
) -> Float64[np.ndarray, "k"]:
    """Distance of every found pixel from the true axis [pixels]."""
    truth, _ = CAMERA.project(polylines.resample(nodes, 1500))
    found = np.concatenate(lines)
    return np.min(np.linalg.norm(found[:, None] - truth[None], axis=2), axis=1)


@pytest.mark.parametrize(
    ("rope", "table"), [(ORANGE, GREY), (WHITE, (40, 60, 110)), ((30, 60, 150), WOOD)]
)
def test_colour_and_centreline_of_a_rope_are_detected(rope: Color, table: Color) -> None:
    picture = taken(rope, table, seed=3).color
    read = detector.detect_ropes(picture)
    # The light at the camera darkens the flanks of a rope.
    assert len(read.ropes) == 1
    (line,) = read.ropes[0].lines
    assert np.max(np.abs(np.subtract(read.ropes[0].color, rope))) < 60
    error = axis_errors([line.pixels], curve(3))
    assert np.median(error) < 0.3
    assert np.percentile(error, 95) < 1.0
    along = polylines.length(line.pixels)
    assert along == pytest.approx(polylines.length(CAMERA.project(curve(3))[0]), rel=0.06)


def test_a_given_colour_selects_one_of_two_ropes() -> None:
    one, other = taken(ORANGE, GREY, seed=3).color, taken((40, 60, 160), GREY, seed=5).color
    blue = other[..., 2].astype(int) - other[..., 0] > 50
    picture = np.where(blue[..., None], other, one)
    read = detector.detect_ropes(picture, (40, 60, 160))
    error = axis_errors([line.pixels for rope in read.ropes for line in rope.lines], curve(5))
    assert np.percentile(error, 95) < 1.0


def test_an_image_without_a_rope_has_none() -> None:
    read = detector.detect_ropes(np.full((240, 320, 3), 120, np.uint8))
    assert (read.ropes, read.crossings) == ([], [])
    assert read.labels.shape == (240, 320)
    assert not read.labels.any()


def test_an_image_that_is_too_small_is_refused() -> None:
    with pytest.raises(ValueError, match="9 x 99 pixels"):
        detector.detect_ropes(np.zeros((99, 9, 3), np.uint8))


def test_what_is_left_out_of_a_noisy_image_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    axis = random_axis(3)
    picture = render_photograph(axis, CableAppearance((225, 225, 220)), "grey", 3)
    other = render_photograph(random_axis(5), CableAppearance((190, 35, 40)), "grey", 5, picture)
    monkeypatch.setattr(detector, "MAX_FRAGMENT_COUNT", 1)
    read = detector.detect_ropes(other)
    assert len(read.ropes) <= 1
    assert read.left_out > 0


def test_drawn_ropes_are_found_by_a_given_colour() -> None:
    picture = np.full((600, 800, 3), (124, 124, 122), np.uint8)
    for k in (1, -1):
        way = np.array([[100, 300 - k * 200], [400, 300 + k * 20], [700, 300 + k * 200]], np.int32)
        cv2.polylines(picture, [way], False, (240, 110, 50), 16, cv2.LINE_AA)
    read = detector.detect_ropes(picture, (240, 110, 50))
    assert len(read.ropes) == 2
    assert len(read.crossings) == 1


@pytest.mark.parametrize(
    ("rope", "table", "shape"),
    [
        (CableAppearance((225, 225, 220)), "wood", 1),
        (CableAppearance((225, 225, 220)), "grey", 2),
        (CableAppearance((28, 28, 30), width=6.0), "print", 3),
        (CableAppearance((190, 35, 40), (225, 225, 220)), "cloth", 4),
        (CableAppearance((30, 60, 160), width=30.0), "tiles", 5),
    ],
)
def test_the_centreline_of_a_glossy_cable_is_complete_on_every_table(
    rope: CableAppearance, table: str, shape: int
) -> None:
    axis = random_axis(shape)
    picture = render_photograph(axis, rope, table, shape)
    for read in (detector.detect_ropes(picture), detector.detect_ropes(picture, rope.color)):
        found = np.concatenate([r.lines[0].pixels for r in read.ropes if r.p_wrong < DOUBTFUL])
        gap = np.linalg.norm(found[:, None] - axis[None, ::4], axis=2)
        # The dark side of a bright cable may have the colour of the table.
        assert np.percentile(np.min(gap, axis=1), 98) < 0.25 * rope.width + 1.0
        assert np.mean(np.min(gap, axis=0) < 0.25 * rope.width + 1.0) > 0.95


def test_two_cables_of_different_colours_are_both_detected() -> None:
    red, black = random_axis(6), random_axis(7)
    picture = render_photograph(red, CableAppearance((190, 35, 40)), "white", 6)
    picture = render_photograph(black, CableAppearance((230, 200, 40)), "wood", 7, over=picture)
    read = detector.detect_ropes(picture)
    seen = [line.pixels for rope in read.ropes for line in rope.lines]
    for axis in (red, black):
        gap = np.linalg.norm(np.concatenate(seen)[:, None] - axis[None, ::8], axis=2)
        assert np.mean(np.min(gap, axis=0) < 4.0) > 0.9


def test_a_shadow_without_a_rope_is_none_or_named() -> None:
    axis = random_axis(8)
    shadow = detector.detect_ropes(render_photograph(axis, None, "white", 8))
    assert not shadow.ropes or shadow.shadow > 0.8
    rope = detector.detect_ropes(render_photograph(axis, CableAppearance((28, 28, 30)), "white", 8))
    assert len(rope.ropes) == 1
    assert rope.shadow < 0.3
