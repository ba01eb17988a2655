"""Every solid of the table against points of its own mesh."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle, pack, segment_distance, signed_distance
from lariat.rod.obstacle_table import unpack
from lariat.shapes import SHAPES, ShapeCode, SolidName

SOLIDS: tuple[SolidName, ...] = get_args(SolidName)
every_solid = pytest.mark.parametrize("shape", SOLIDS)


def body(shape: SolidName) -> Obstacle:
    turn = tuple(poses.normalized(np.array([0.9, 0.3, -0.2, 0.4])).tolist())
    fields = SHAPES[shape].unpack(SHAPES[shape].filling(0.12, 0.08, 0.2))
    return Obstacle(shape, (0.1, -0.2, 0.3), turn, **fields)


def corners(solid: Obstacle) -> np.ndarray:
    """Corners of a fine mesh, in the world."""
    local = solid.row.mesh(solid.packed_sizes, 400).points
    return poses.rotate(np.array(solid.orientation), local) + np.array(solid.position)


def surface(solid: Obstacle) -> np.ndarray:
    """Points all over the surface, in the world."""
    mesh = solid.row.mesh(solid.packed_sizes, 60)
    triangles = mesh.points[mesh.triangles]
    edges = triangles[:, 1:] - triangles[:, :1]
    areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    rng = np.random.default_rng(0)
    chosen = rng.choice(len(triangles), 100_000, p=areas / areas.sum())
    shares = rng.dirichlet(np.ones(3), len(chosen))
    local = np.einsum("nk,nka->na", shares, triangles[chosen])
    return poses.rotate(np.array(solid.orientation), local) + np.array(solid.position)


@every_solid
def test_distance_is_that_of_the_nearest_point_of_the_surface(shape: SolidName) -> None:
    solid = body(shape)
    points = np.array(solid.position) + 0.15 * np.random.default_rng(1).normal(size=(300, 3))
    nearest, _ = cKDTree(surface(solid)).query(points)
    distance = signed_distance(points, solid)
    # The flat faces between the ten rings of a round surface lie up to 1 mm below it.
    np.testing.assert_allclose(np.abs(distance), nearest, atol=2e-3)
    assert np.any(distance < 0.0)
    assert signed_distance(np.array(solid.position), solid) < 0.0


@every_solid
def test_extents_radius_and_thickness_are_those_of_the_mesh(shape: SolidName) -> None:
    solid = body(shape)
    offsets = corners(solid) - np.array(solid.position)
    directions = np.concatenate([np.eye(3), -np.eye(3)])
    support = solid.support_along(directions)
    np.testing.assert_allclose(support, (offsets @ directions.T).max(axis=0), atol=2e-3)
    np.testing.assert_allclose(solid.extents, np.maximum(support[:3], support[3:]))
    assert np.linalg.norm(offsets, axis=1).max() <= solid.bounding_radius + 1e-9
    widths = np.random.default_rng(2).normal(size=(2000, 3))
    widths /= np.linalg.norm(widths, axis=1, keepdims=True)
    least = (solid.support_along(widths) + solid.support_along(-widths)).min()
    assert 0.5 * least < solid.thickness < least + 1e-3


@every_solid
def test_faces_of_a_mesh_look_outwards_and_close_it(shape: SolidName) -> None:
    mesh = SHAPES[shape].mesh(body(shape).packed_sizes)
    corners = mesh.points[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(np.sum(normals * corners.mean(axis=1), axis=1) > 0.0)
    edges = {(int(f[k - 1]), int(f[k])) for f in mesh.triangles for k in range(3)}
    assert all((b, a) in edges for a, b in edges)


@every_solid
def test_what_is_shrunk_lies_inside_and_no_deeper_than_asked(shape: SolidName) -> None:
    solid = body(shape)
    core = solid.with_sizes(solid.row.shrunk(solid.packed_sizes, 0.002))
    depths = -signed_distance(corners(core), solid)
    assert depths.min() > 0.0
    assert depths.max() < 0.002 * 1.8, "corners lie deeper than faces"


@every_solid
def test_lines_cut_a_solid_that_come_below_its_surface(shape: SolidName) -> None:
    solid = body(shape)
    rng = np.random.default_rng(3)
    starts, ends = rng.uniform(-0.2, 0.2, (2, 2000, 3)) + np.array(solid.position)
    begins, there = solid.local(starts), solid.local(ends)
    sizes = np.broadcast_to(solid.packed_sizes, begins.shape)
    inside, cut = solid.row.cuts(sizes, begins, there - begins)
    distances = segment_distance(starts, ends, solid)
    sure = np.abs(distances) > 1e-5
    np.testing.assert_array_equal(cut[sure], distances[sure] < 0.0)
    np.testing.assert_array_equal(inside, signed_distance(starts, solid) < 0.0)
    assert 0.1 < cut.mean() < 0.9


@pytest.mark.parametrize("shape", SHAPES)
def test_packed_bodies_are_unpacked_as_they_were(shape: SolidName) -> None:
    wall = Obstacle("half_space", (0.0, 0.0, 0.1), normal=(0.0, 0.6, 0.8))
    solid = wall if shape == "half_space" else body(shape)
    packed = pack([solid])
    assert packed[0, 0] == ShapeCode[shape.upper()]
    np.testing.assert_allclose(pack(unpack(packed)), packed)


@pytest.mark.parametrize(
    ("shape", "count"), [("box", 24), ("cylinder", 4 * 40), ("sphere", 8 * 40 + 2)]
)
def test_only_sharp_edges_get_corners_of_their_own(shape: SolidName, count: int) -> None:
    mesh = SHAPES[shape].mesh(body(shape).packed_sizes, 40)
    split = mesh.with_edges()
    assert len(split.points) == count
    for face, former in zip(split.faces, mesh.faces, strict=True):
        np.testing.assert_array_equal(split.points[list(face)], mesh.points[list(former)])
