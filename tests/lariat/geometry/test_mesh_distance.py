"""Distances from meshes are those of the bodies that they show."""

from __future__ import annotations

import coal  # pyright: ignore[reportMissingImports]  # its wheel lives beside site-packages
import numpy as np
import pytest

from lariat.geometry.mesh_distance import MeshDistance, is_closed, nearest_points
from lariat.geometry.obstacles import Obstacle, signed_distance
from tests.lariat.geometry.meshes import box_mesh, ring_mesh

POINTS = np.random.default_rng(0).uniform(-0.12, 0.12, (300, 3))


def test_the_distance_from_a_box_is_that_of_its_shape() -> None:
    mesh = box_mesh((-0.05, -0.03, -0.02), (0.05, 0.03, 0.02))
    body = Obstacle("box", (0.0, 0.0, 0.0), size=(0.1, 0.06, 0.04))
    expected = np.maximum(signed_distance(POINTS, body), 0.0)
    for triangles in (mesh, mesh[:, ::-1]):
        assert MeshDistance(triangles).outside(POINTS) == pytest.approx(expected, abs=1e-12)


def test_the_distance_from_many_triangles_is_that_of_another_library() -> None:
    mesh = ring_mesh(0.08, 0.015, 100, 40)
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(mesh), 3 * len(mesh))
    for corners in mesh:
        model.addTriangle(*corners)
    model.endModel()
    radius, request = 1e-3, coal.DistanceRequest()
    expected = [
        coal.distance(
            model,
            coal.Transform3s(),
            coal.Sphere(radius),
            coal.Transform3s(np.eye(3), point),
            request,
            coal.DistanceResult(),
        )
        + radius
        for point in POINTS
    ]
    found = MeshDistance(mesh).outside(POINTS)
    inside = np.hypot(np.hypot(POINTS[:, 0], POINTS[:, 1]) - 0.08, POINTS[:, 2]) < 0.0145
    far = np.array(expected) > radius
    assert np.all(found[inside] == 0.0)
    assert np.sum(far & (found > 0.0)) > 250
    assert found[far & (found > 0.0)] == pytest.approx(
        np.array(expected)[far & (found > 0.0)], abs=1e-12
    )


def test_an_open_mesh_has_no_inside() -> None:
    mesh = box_mesh((-0.05, -0.05, -0.05), (0.05, 0.05, 0.05))
    assert is_closed(mesh)
    assert not is_closed(mesh[1:])
    inside = np.zeros((1, 3))
    assert MeshDistance(mesh).outside(inside) == 0.0
    assert MeshDistance(mesh[1:]).outside(inside) == pytest.approx(0.05)


def test_the_nearest_point_of_a_triangle_is_nearer_than_its_others() -> None:
    random = np.random.default_rng(2)
    triangles, points = random.normal(size=(50, 3, 3)), random.normal(size=(50, 3))
    nearest = np.linalg.norm(nearest_points(points, triangles) - points, axis=1)
    shares = random.dirichlet(np.ones(3), 3000)
    others = np.einsum("sk,pkc->psc", shares, triangles)
    least = np.linalg.norm(others - points[:, None], axis=2).min(axis=1)
    assert np.all(nearest <= least + 1e-12)
    assert nearest == pytest.approx(least, abs=0.1)


def test_large_triangles_that_cross_each_other_are_refused_at_once() -> None:
    triangles = np.random.default_rng(0).uniform(-0.5, 0.5, (100_000, 3, 3))
    mesh = MeshDistance(triangles)
    with pytest.raises(ValueError, match="cross"):
        mesh.outside(triangles[:50, 0])
    assert mesh.compared < 3_000_000
