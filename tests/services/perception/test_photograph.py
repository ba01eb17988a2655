"""Pictures of unknown cameras: the rope's colour is found, its centre lines are sub-pixel."""

from __future__ import annotations

import numpy as np
import pytest
from jaxtyping import Float64

from services.perception import photograph
from services.perception.segmentation import Color
from shared.geometry import polylines
from tests.services.perception.scenes import CAMERA, curve
from tests.services.perception.test_segmentation import GREY, ORANGE, WOOD, taken

WHITE: Color = (235, 235, 230)


def away(lines: list[np.ndarray], nodes: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, "k"]:
    """Distance of every found pixel from the true axis [pixels]."""
    truth, _ = CAMERA.project(polylines.resampled(nodes, 1500))
    found = np.concatenate(lines)
    return np.min(np.linalg.norm(found[:, None] - truth[None], axis=2), axis=1)


@pytest.mark.parametrize(
    ("rope", "table"), [(ORANGE, GREY), (WHITE, (40, 60, 110)), ((30, 60, 150), WOOD)]
)
def test_colour_and_centre_line_are_found_in_a_picture(rope: Color, table: Color) -> None:
    picture = taken(rope, table, seed=3).color
    found, _ = photograph.found_color(picture)
    # A headlight dims the flanks of a rope and never brightens it.
    assert np.max(np.abs(np.subtract(found, rope))) < 60
    read = photograph.read(picture)
    error = away([line.pixels for line in read.lines], curve(3))
    assert np.median(error) < 0.3
    assert np.percentile(error, 95) < 1.0
    along = sum(polylines.length(line.pixels) for line in read.lines)
    assert along == pytest.approx(polylines.length(CAMERA.project(curve(3))[0]), rel=0.06)


def test_a_given_colour_picks_one_of_two_ropes() -> None:
    one, other = taken(ORANGE, GREY, seed=3).color, taken((40, 60, 160), GREY, seed=5).color
    blue = other[..., 2].astype(int) - other[..., 0] > 50
    picture = np.where(blue[..., None], other, one)
    read = photograph.read(picture, (40, 60, 160))
    error = away([line.pixels for line in read.lines], curve(5))
    assert np.percentile(error, 95) < 1.0


def test_a_picture_without_a_rope_is_refused() -> None:
    with pytest.raises(ValueError, match="long, thin"):
        photograph.found_color(np.full((240, 320, 3), 120, np.uint8))
