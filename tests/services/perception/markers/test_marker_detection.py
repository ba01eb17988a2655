from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from lariat.geometry.cameras import Camera, Intrinsics, looking_at
from services.perception.markers.marker_detection import (
    ARUCO_DICTIONARY,
    MarkerDetector,
    mask_markers,
)
from services.perception.markers.marker_pose import MarkerPose, MarkerPoseFilter, locate_marker

CAMERA = Camera(
    Intrinsics.symmetric(1280, 720, math.radians(65.0)),
    looking_at((0.1, -0.3, 0.9), (0.0, 0.0, 0.0)),
)
SIDE = 0.06
FINE = 3
"""Pictures are drawn this much larger and then averaged down, as a sensor does."""


def picture(position: tuple[float, float, float], yaw: float, identity: int) -> np.ndarray:
    """A tag with its white border on a grey table, with a little sensor noise."""
    cells = 60
    tag = np.full((8 * cells, 8 * cells), 255, np.uint8)
    tag[cells:-cells, cells:-cells] = cv2.aruco.generateImageMarker(
        ARUCO_DICTIONARY, identity, 6 * cells
    )
    half = SIDE / 2.0 * 8.0 / 6.0
    square = half * np.array([[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])
    c, s = math.cos(yaw), math.sin(yaw)
    corners = np.zeros((4, 3)) + position
    corners[:, :2] += square @ np.array([[c, s], [-s, c]])
    pixels, _ = CAMERA.project(corners)
    # The centre of a fine pixel lies between those of the coarse ones.
    fine = FINE * pixels + (FINE - 1) / 2.0
    source = np.array([[0, 0], [8, 0], [8, 8], [0, 8]], np.float32) * cells - 0.5
    warp = cv2.getPerspectiveTransform(source, fine.astype(np.float32))
    large = cv2.warpPerspective(
        tag, warp, (FINE * 1280, FINE * 720), flags=cv2.INTER_LINEAR, borderValue=90
    )
    small = cv2.resize(large, (1280, 720), interpolation=cv2.INTER_AREA).astype(float)
    noisy = small + np.random.default_rng(identity).normal(0.0, 2.0, small.shape)
    return np.repeat(np.clip(noisy, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.5])
@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (0.2, 0.1, 0.16), (-0.25, -0.1, 0.05)])
def test_a_tag_on_a_known_plane_is_placed_to_a_millimetre_and_half_a_degree(
    place: tuple[float, float, float], yaw: float
) -> None:
    (sighting,) = MarkerDetector().detect(picture(place, yaw, 7))
    assert sighting.identity == 7
    found = locate_marker(sighting, CAMERA, place[2])
    assert found is not None
    assert np.linalg.norm(found.position - place) < 1e-3
    assert abs(math.remainder(found.yaw - yaw, 2.0 * math.pi)) < math.radians(0.5)
    assert found.side == pytest.approx(SIDE, rel=0.02)
    assert found.residual < 5e-4


def test_a_wrong_height_shows_in_the_side() -> None:
    (sighting,) = MarkerDetector().detect(picture((0.0, 0.0, 0.16), 0.3, 3))
    found = locate_marker(sighting, CAMERA, 0.0)
    assert found is not None
    assert found.side > 1.15 * SIDE


def test_a_plane_above_the_camera_has_no_tag() -> None:
    (sighting,) = MarkerDetector().detect(picture((0.0, 0.0, 0.0), 0.0, 3))
    assert locate_marker(sighting, CAMERA, 1.5) is None


def test_a_masked_tag_is_no_rope() -> None:
    image = picture((0.0, 0.0, 0.0), 0.4, 5)
    sightings = MarkerDetector().detect(image)
    assert np.count_nonzero(image[..., 0] > 200) > 1000
    assert np.count_nonzero(mask_markers(image, sightings)[..., 0] > 200) == 0


def test_one_wild_sighting_does_not_move_an_obstacle() -> None:
    steady = MarkerPoseFilter()
    here = MarkerPose(np.array([0.1, 0.2, 0.0]), math.pi - 0.01, SIDE, 0.0)
    there = MarkerPose(np.array([0.4, 0.2, 0.0]), 0.0, SIDE, 0.0)
    over = MarkerPose(np.array([0.1, 0.2, 0.0]), -math.pi + 0.01, SIDE, 0.0)
    for p in (here, over, here):
        steady.add(p)
    np.testing.assert_allclose(steady.add(there).position, here.position)
    # A yaw that wanders across half a turn stays there.
    assert abs(abs(steady.add(over).yaw) - math.pi) < 0.02
    moved = [steady.add(there) for _ in range(4)][-1]
    np.testing.assert_allclose(moved.position, there.position)
