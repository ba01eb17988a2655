from __future__ import annotations

import cv2
import numpy as np
import pytest

from lariat.perception.centerline.estimator import CenterlineEstimator
from lariat.perception.rgbd.lens_distortion import Undistortion
from tests.services.perception.scenes import CAMERA, ROPE, curve, grips, taken

LENS = (0.09, -0.12, 0.001, -0.0008, 0.03)


def undistortion(lens: tuple[float, ...] = LENS, model: str = "plumb_bob") -> Undistortion:
    return Undistortion(CAMERA.intrinsics, lens, model)


def distorted(image: np.ndarray, interpolation: int) -> np.ndarray:
    """Image of a pinhole camera, distorted by the lens."""
    i = CAMERA.intrinsics
    matrix = np.array([[i.fx, 0.0, i.cx], [0.0, i.fy, i.cy], [0.0, 0.0, 1.0]])
    height, width = image.shape[:2]
    grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1).astype(np.float64)
    straight = cv2.undistortPoints(grid.reshape(-1, 1, 2), matrix, np.array(LENS), P=matrix)
    maps = straight.reshape(height, width, 2).astype(np.float32)
    return cv2.remap(image, maps[..., 0], maps[..., 1], interpolation)


def test_undistorted_images_reduce_the_error_of_the_estimate() -> None:
    nodes = curve(3) + np.array([0.12, 0.06, 0.0])
    frame = taken(nodes)
    color, depth = (
        distorted(frame.color, cv2.INTER_LINEAR),
        distorted(frame.depth, cv2.INTER_NEAREST),
    )
    estimator = CenterlineEstimator(CAMERA, ROPE)
    raw = estimator.estimate(color, depth, *grips(nodes))
    straight = estimator.estimate(*undistortion()(color, depth), *grips(nodes))
    errors = [np.mean(np.linalg.norm(e.positions - nodes, axis=1)) for e in (raw, straight)]
    assert errors[0] > 0.7e-3
    assert errors[1] < 0.3e-3


def test_images_without_distortion_are_returned_unchanged() -> None:
    frame = taken(curve(1))
    color, depth = undistortion((0.0,) * 5)(frame.color, frame.depth)
    assert color is frame.color
    assert depth is frame.depth


def test_unknown_distortion_models_are_refused() -> None:
    with pytest.raises(ValueError, match="kannala_brandt4"):
        undistortion(LENS[:4], "kannala_brandt4")
    with pytest.raises(ValueError, match="coefficients"):
        undistortion(LENS[:3])
