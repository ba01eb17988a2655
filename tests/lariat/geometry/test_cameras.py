from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lariat.geometry.cameras import Camera, Intrinsics, looking_at

CAMERA = Camera(
    Intrinsics.symmetric(640, 480, math.radians(60.0)),
    looking_at((0.1, -0.7, 0.6), (0.0, 0.0, 0.2)),
)


@given(
    st.tuples(*[st.floats(-0.3, 0.3)] * 3).map(np.array),
)
def test_back_projection_undoes_projection(point: np.ndarray) -> None:
    pixel, depth = CAMERA.project(point)
    assert depth > 0.0
    np.testing.assert_allclose(CAMERA.back_project(pixel, depth), point, atol=1e-12)


def test_target_lies_on_the_principal_point() -> None:
    pixel, depth = CAMERA.project(np.array([0.0, 0.0, 0.2]))
    np.testing.assert_allclose(pixel, [319.5, 239.5], atol=1e-9)
    assert depth == pytest.approx(math.dist((0.1, -0.7, 0.6), (0.0, 0.0, 0.2)))


def test_up_in_the_world_is_up_in_the_image() -> None:
    (low, high), _ = CAMERA.project(np.array([[0.0, 0.0, 0.1], [0.0, 0.0, 0.3]]))
    assert high[1] < low[1]


def test_half_the_view_spans_half_the_pixels() -> None:
    intrinsics = Intrinsics.symmetric(640, 480, math.radians(90.0))
    pixel, _ = intrinsics.project(np.array([1.0, 0.0, 1.0]))
    # The edge of the image is half a pixel beyond the centre of its last pixel.
    assert pixel[0] == pytest.approx(639.5)


def test_rays_have_unit_depth() -> None:
    pixels = np.array([[0.0, 0.0], [639.0, 479.0]])
    origin = CAMERA.T_world_camera.position
    np.testing.assert_allclose(
        origin + 0.8 * CAMERA.rays(pixels), CAMERA.back_project(pixels, np.full(2, 0.8))
    )


@pytest.mark.parametrize("fx", [0.0, -1.0, math.nan])
def test_impossible_focal_lengths_are_refused_by_name(fx: float) -> None:
    with pytest.raises(ValueError, match="focal lengths"):
        Intrinsics(640, 480, fx, 500.0, 319.5, 239.5)


def test_looking_along_up_is_refused() -> None:
    with pytest.raises(ValueError, match="upward"):
        looking_at((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))


def test_a_camera_that_looks_straight_down_has_y_upwards() -> None:
    view = Camera(CAMERA.intrinsics, looking_at((0.0, 0.0, 1.0), (0.0, 0.0, 0.0)))
    (middle, far), _ = view.project(np.array([[0.0, 0.0, 0.0], [0.0, 0.1, 0.0]]))
    assert far[1] < middle[1]
    assert far[0] == pytest.approx(middle[0])
