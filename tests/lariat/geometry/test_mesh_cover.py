"""Bodies around a mesh contain it, and reach no further beyond it than they say."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.mesh_cover import MeshCover, cover_mesh, split, volume
from lariat.geometry.obstacles import scene_distance, signed_distance
from tests.lariat.geometry.meshes import box_mesh, prism_mesh, ring_mesh

ANGLE = [(0.0, 0.0), (0.1, 0.0), (0.1, 0.02), (0.02, 0.02), (0.02, 0.08), (0.0, 0.08)]
"""Outline of an angle bracket [m]."""


@pytest.fixture(scope="module")
def ring() -> np.ndarray:
    return ring_mesh(0.08, 0.015, 12, 5)


@pytest.fixture(scope="module")
def ring_cover(ring: np.ndarray) -> MeshCover:
    return cover_mesh(ring, 8, 5e-4)


def turned(triangles: np.ndarray) -> np.ndarray:
    turn = poses.exponential(np.array([0.4, -0.9, 0.3]))
    return poses.rotate(turn, triangles) + np.array([0.1, 0.2, 0.3])


def points_on(triangles: np.ndarray, count: int) -> np.ndarray:
    random = np.random.default_rng(0)
    share = random.dirichlet(np.ones(3), count)
    return np.einsum("pk,pkc->pc", share, triangles[random.integers(len(triangles), size=count)])


def test_a_turned_box_is_one_box() -> None:
    mesh = turned(box_mesh((0.0, 0.0, 0.0), (0.1, 0.06, 0.03)))
    cover = cover_mesh(mesh, 8, 1e-4)
    (body,) = cover.bodies
    assert body.shape == "box"
    assert sorted(body.size) == pytest.approx([0.03, 0.06, 0.1], abs=1e-5)
    assert cover.overreach < 1e-5


def test_a_tube_of_facets_is_one_cylinder() -> None:
    around = 2.0 * np.pi * np.arange(32) / 32
    mesh = prism_mesh(0.03 * np.stack([np.cos(around), np.sin(around)], axis=1), 0.1)
    cover = cover_mesh(turned(mesh), 8, 5e-4)
    (body,) = cover.bodies
    assert (body.shape, body.radius, body.height) == pytest.approx(
        ("cylinder", 0.03, 0.1), abs=1e-5
    )
    sagitta = 0.03 * (1.0 - np.cos(np.pi / 32))
    assert cover.overreach == pytest.approx(sagitta, abs=2e-5)


def test_an_angle_bracket_is_two_boxes() -> None:
    cover = cover_mesh(prism_mesh(ANGLE, 0.05), 8, 5e-4)
    assert sorted(volume(b) for b in cover.bodies) == pytest.approx([6e-5, 1e-4], rel=1e-3)
    assert cover.overreach < 1e-5


def test_a_ring_is_covered_and_stays_open(ring: np.ndarray, ring_cover: MeshCover) -> None:
    assert np.max(scene_distance(points_on(ring, 4000), ring_cover.bodies)) <= 0.0
    # The tube's circle lies inside the mesh.
    around = ring_mesh(0.08, 1e-9, 12, 5).reshape(-1, 3)
    assert np.max(scene_distance(around, ring_cover.bodies)) < 0.0
    assert scene_distance(np.zeros((1, 3)), ring_cover.bodies)[0] > 0.05


def test_bodies_reach_no_further_than_they_say(ring_cover: MeshCover) -> None:
    random = np.random.default_rng(1)
    points = random.uniform([-0.12, -0.12, -0.04], [0.12, 0.12, 0.04], (200_000, 3))
    covered = points[scene_distance(points, ring_cover.bodies) < 0.0]
    away = np.hypot(np.hypot(covered[:, 0], covered[:, 1]) - 0.08, covered[:, 2]) - 0.015
    # The mesh lies inside the torus by up to the sagitta of its facets.
    assert np.max(away) < ring_cover.overreach + 1e-4
    assert np.max(away) > 0.5 * ring_cover.overreach


def test_more_bodies_reach_less_far(ring: np.ndarray, ring_cover: MeshCover) -> None:
    assert ring_cover.overreach < 0.6 * cover_mesh(ring, 2, 5e-4).overreach


def test_parts_of_a_split_keep_the_area_and_their_side(ring: np.ndarray) -> None:
    normal = poses.normalized(np.array([1.0, 0.3, 0.2]))
    below, above = split(ring, normal, 0.02)

    def area(t: np.ndarray) -> float:
        return float(np.sum(np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1)))

    assert area(below) + area(above) == pytest.approx(area(ring), rel=1e-9)
    assert np.max(below @ normal) <= 0.02 + 1e-12
    assert np.min(above @ normal) >= 0.02 - 1e-12


def test_a_flat_plate_has_a_thickness() -> None:
    plate = np.array(
        [[[0.0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0]], [[0, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]]]
    )
    (body,) = cover_mesh(plate, 4, 1e-3).bodies
    assert min(body.size) == pytest.approx(5e-4, abs=1e-5)
    assert np.max(signed_distance(plate.reshape(-1, 3), body)) <= 0.0


def test_a_mesh_without_area_is_refused() -> None:
    with pytest.raises(ValueError, match="area"):
        cover_mesh(np.zeros((3, 3, 3)), 4, 1e-3)


def test_mesh_that_takes_too_long_is_divided_no_further(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = ring_mesh(0.08, 0.015, 12, 5)
    whole = cover_mesh(mesh, 12, 1e-4)
    monkeypatch.setattr("lariat.geometry.mesh_cover.MAX_COMPARED", 100)
    assert 1 <= len(cover_mesh(mesh, 12, 1e-4).bodies) < len(whole.bodies)
