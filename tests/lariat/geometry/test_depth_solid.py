"""The solid behind a depth image contains the surface that was seen, and bodies around it do."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry.depth_cover import cover_depth
from lariat.geometry.depth_solid import DepthSolid, SolidRange
from lariat.geometry.obstacles import scene_distance
from tests.lariat.geometry.depth_scene import CAMERA, EXTENT, SCENE, depths, image_of


@pytest.fixture(scope="module")
def image() -> np.ndarray:
    return image_of()


@pytest.fixture(scope="module")
def surface() -> np.ndarray:
    """Points of the true surface between the pixels that the image shows [m]."""
    random = np.random.default_rng(7)
    pixels = random.uniform([0.0, 0.0], [319.0, 239.0], (40_000, 2))
    points = CAMERA.back_project(pixels, depths(pixels))
    return points[points[:, 2] > EXTENT.floor]


@pytest.fixture(scope="module")
def solid(image: np.ndarray) -> DepthSolid:
    return DepthSolid(image, CAMERA, EXTENT)


def test_each_point_of_the_surface_lies_in_the_column_of_its_tile(
    solid: DepthSolid, surface: np.ndarray
) -> None:
    columns = solid.columns(600)
    assert len(columns.depths) <= 600
    corners, _ = CAMERA.project(columns.corners)
    low, high = corners.min(axis=1), corners.max(axis=1)
    pixels, depth = CAMERA.project(surface)
    inside = (pixels[:, None] >= low - 1e-6) & (pixels[:, None] <= high + 1e-6)
    held = inside.all(axis=2) & (depth[:, None] >= columns.depths)
    assert held.any(axis=1).all()


def test_bodies_contain_the_surface_and_say_how_far_they_stick_out(
    solid: DepthSolid, surface: np.ndarray
) -> None:
    cover = cover_depth(solid, 12, 2e-3)
    assert len(surface) > 2000
    assert np.max(scene_distance(surface, cover.bodies)) < 1e-5
    # Free space stays free: what is seen, empty and covered is as near to the solid as stated.
    random = np.random.default_rng(8)
    points = random.uniform([-0.4, -0.4, 0.01], [0.4, 0.4, 0.4], (40_000, 3))
    covered = points[scene_distance(points, cover.bodies) < 0.0]
    beyond = solid.outside(covered)
    assert len(covered) > 500
    assert beyond.max() < cover.overreach + 2e-3


def test_distance_from_the_solid_is_that_from_the_scene(solid: DepthSolid) -> None:
    above = np.array([[0.15, -0.12, 0.2], [-0.15, 0.0, 0.23], [0.05, 0.1, 0.15]])
    np.testing.assert_allclose(solid.outside(above), scene_distance(above, SCENE[1:]), atol=3e-3)
    # Below the ball the camera sees nothing.
    assert solid.outside(np.array([[0.15, -0.10, 0.02]]))[0] == 0.0


def test_small_holes_are_closed_and_large_ones_are_stated(image: np.ndarray) -> None:
    holed = image.copy()
    holed[::7, ::7] = 0.0
    closed = DepthSolid(holed, CAMERA, EXTENT)
    assert closed.unknown == 0.0
    holed[100:140, 100:160] = np.nan
    opened = DepthSolid(holed, CAMERA, EXTENT)
    assert opened.unknown == pytest.approx(34 * 54 / image.size, rel=0.02)


def test_an_image_without_a_surface_is_refused(image: np.ndarray) -> None:
    with pytest.raises(ValueError, match=r"0\.05.*0\.3 m"):
        DepthSolid(image, CAMERA, SolidRange(far=0.3))
