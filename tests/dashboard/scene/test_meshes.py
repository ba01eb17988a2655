from __future__ import annotations

import numpy as np
import pytest

from dashboard.scene import meshes
from lariat.geometry import poses


def volume(mesh: meshes.Mesh) -> float:
    """By the divergence theorem; positive when every face looks outwards."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.sum(np.cross(a, b) * c) / 6.0)


def test_closed_bodies_enclose_their_volume_from_outside() -> None:
    r, h = 0.03, 0.16
    cylinder = np.pi * r**2 * h
    for mesh, exact in (
        (meshes.of_shape("box", 0.1, 0.2, 0.3), 8.0 * 0.1 * 0.2 * 0.3),
        (meshes.of_shape("cylinder", r, h / 2.0, sides=200), cylinder),
        (meshes.of_shape("capsule", r, h / 2.0, sides=200), cylinder + 4.0 / 3.0 * np.pi * r**3),
        (meshes.of_shape("sphere", r, sides=200), 4.0 / 3.0 * np.pi * r**3),
        (meshes.of_shape("cone", r, h / 2.0, sides=200), cylinder / 3.0),
    ):
        # Ten rings of a round surface enclose 4 % less.
        assert volume(mesh) == pytest.approx(exact, rel=0.04)


def test_wall_of_a_tube_has_no_lids() -> None:
    wall = meshes.tube_wall(16)
    assert len(wall.faces) == 2 * 16
    middles = wall.vertices[wall.faces].mean(axis=1)
    assert np.linalg.norm(middles[:, :2], axis=1).min() > 0.9


def test_every_segment_of_a_tube_reaches_from_node_to_node() -> None:
    nodes = np.random.default_rng(0).normal(size=(12, 3))
    segments = meshes.tube(nodes, 0.004)
    half = poses.rotate(segments.orientations, 0.5 * segments.scales * np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(segments.centres - half, nodes[:-1], atol=1e-12)
    np.testing.assert_allclose(segments.centres + half, nodes[1:], atol=1e-12)
    np.testing.assert_array_equal(segments.scales[:, :2], 0.004)


def test_nodes_at_one_place_make_a_flat_segment_and_no_nan() -> None:
    segments = meshes.tube(np.zeros((3, 3)), 0.004)
    assert np.all(np.isfinite(segments.orientations))
    np.testing.assert_array_equal(segments.scales[:, 2], 0.0)
