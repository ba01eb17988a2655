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
    assert volume(meshes.cylinder(r, h, sides=200)) == pytest.approx(np.pi * r**2 * h, rel=2e-3)
    capsule = np.pi * r**2 * h + 4.0 / 3.0 * np.pi * r**3
    assert volume(meshes.capsule(r, h, sides=200)) == pytest.approx(capsule, rel=1e-2)
    assert volume(meshes.capsule(r, 0.0, sides=200)) == pytest.approx(
        4.0 / 3.0 * np.pi * r**3, rel=1e-2
    )


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
