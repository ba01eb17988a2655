from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from lariat.geometry.cameras import Camera, Intrinsics, looking_at
from lariat.perception.markers.marker_detection import (
    ARUCO_DICTIONARY,
    MarkerDetector,
    mask_markers,
)
from lariat.perception.markers.marker_pose import MarkerPose, MarkerPoseFilter, locate_marker

CAMERA = Camera(
    Intrinsics.symmetric(1280, 720, math.radians(65.0)),
    looking_at((0.1, -0.3, 0.9), (0.0, 0.0, 0.0)),
)
SIDE = 0.06
OVERSAMPLING = 3
"""Factor by which images are rendered larger before they are averaged, as by a sensor."""


def picture(position: tuple[float, float, float], yaw: float, identity: int) -> np.ndarray:
    """Image of a marker with its white border on a grey table, with sensor noise."""
    cells = 60
    marker = np.full((8 * cells, 8 * cells), 255, np.uint8)
    marker[cells:-cells, cells:-cells] = cv2.aruco.generateImageMarker(
        ARUCO_DICTIONARY, identity, 6 * cells
    )
    half = SIDE / 2.0 * 8.0 / 6.0
    square = half * np.array([[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])
    c, s = math.cos(yaw), math.sin(yaw)
    corners = np.zeros((4, 3)) + position
    corners[:, :2] += square @ np.array([[c, s], [-s, c]])
    pixels, _ = CAMERA.project(corners)
    # Pixel centres of the oversampled image.
    fine = OVERSAMPLING * pixels + (OVERSAMPLING - 1) / 2.0
    source = np.array([[0, 0], [8, 0], [8, 8], [0, 8]], np.float32) * cells - 0.5
    warp = cv2.getPerspectiveTransform(source, fine.astype(np.float32))
    large = cv2.warpPerspective(
        marker,
        warp,
        (OVERSAMPLING * 1280, OVERSAMPLING * 720),
        flags=cv2.INTER_LINEAR,
        borderValue=90,
    )
    small = cv2.resize(large, (1280, 720), interpolation=cv2.INTER_AREA).astype(float)
    noisy = small + np.random.default_rng(identity).normal(0.0, 2.0, small.shape)
    return np.repeat(np.clip(noisy, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.5])
@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (0.2, 0.1, 0.16), (-0.25, -0.1, 0.05)])
def test_a_marker_on_a_known_plane_is_located_within_a_millimetre_and_half_a_degree(
    place: tuple[float, float, float], yaw: float
) -> None:
    (detection,) = MarkerDetector().detect(picture(place, yaw, 7))
    assert detection.identity == 7
    found = locate_marker(detection, CAMERA, place[2])
    assert found is not None
    assert np.linalg.norm(found.position - place) < 1e-3
    assert abs(math.remainder(found.yaw - yaw, 2.0 * math.pi)) < math.radians(0.5)
    assert found.side == pytest.approx(SIDE, rel=0.02)
    assert found.residual < 5e-4


def test_a_wrong_plane_height_gives_a_wrong_side_length() -> None:
    (detection,) = MarkerDetector().detect(picture((0.0, 0.0, 0.16), 0.3, 3))
    found = locate_marker(detection, CAMERA, 0.0)
    assert found is not None
    assert found.side > 1.15 * SIDE


def test_a_marker_above_the_camera_has_no_pose() -> None:
    (detection,) = MarkerDetector().detect(picture((0.0, 0.0, 0.0), 0.0, 3))
    assert locate_marker(detection, CAMERA, 1.5) is None


def test_masked_markers_leave_no_bright_pixels() -> None:
    image = picture((0.0, 0.0, 0.0), 0.4, 5)
    detections = MarkerDetector().detect(image)
    assert np.count_nonzero(image[..., 0] > 200) > 1000
    assert np.count_nonzero(mask_markers(image, detections)[..., 0] > 200) == 0


def test_the_pose_filter_ignores_one_outlier_and_follows_repeated_ones() -> None:
    steady = MarkerPoseFilter()
    here = MarkerPose(np.array([0.1, 0.2, 0.0]), math.pi - 0.01, SIDE, 0.0)
    there = MarkerPose(np.array([0.4, 0.2, 0.0]), 0.0, SIDE, 0.0)
    over = MarkerPose(np.array([0.1, 0.2, 0.0]), -math.pi + 0.01, SIDE, 0.0)
    for p in (here, over, here):
        steady.add(p)
    np.testing.assert_allclose(steady.add(there).position, here.position)
    # The median of yaws around half a turn is half a turn.
    assert abs(abs(steady.add(over).yaw) - math.pi) < 0.02
    moved = [steady.add(there) for _ in range(4)][-1]
    np.testing.assert_allclose(moved.position, there.position)
