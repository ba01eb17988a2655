"""Convex hulls of the meshes of an arm's links, for viewers that do not have their files.

Pinocchio reads the meshes and SciPy computes the hulls; where one of them is not installed, as in
the recorder's image, links that are meshes are not drawn.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
from jaxtyping import Float64, Int32

from lariat.arms.description import arm_description
from lariat.scenario import Scenario, Side

log = logging.getLogger(__name__)

GRID = 0.005
"""Grid to which the corners of meshes are rounded, so that a hull has few of them [m]."""


@dataclass(frozen=True)
class MeshHull:
    """Convex hull of the meshes of one link."""

    link: str
    """Name of the link."""
    points: Float64[np.ndarray, "k 3"]
    """Corners in the link's frame [m]."""
    triangles: Int32[np.ndarray, "t 3"]
    """Corners of each triangle."""


def mesh_hulls(scenario: Scenario, side: Side) -> tuple[MeshHull, ...]:
    """Return the hulls of the links of the arm at an end whose collision geometry is a mesh."""
    description = arm_description(scenario, side)
    if description is None or find_spec("pinocchio") is None or find_spec("scipy") is None:
        return ()
    # Imported late: the recorder runs without Pinocchio.
    from lariat.arms.kinematics import load_arm

    try:
        model, geometry = load_arm(description.urdf, description.flange)
    except ValueError as error:
        # A recording's scenario may name a file of another machine.
        log.warning("meshes of the %s arm are not drawn: %s", side, error)
        return ()
    corners: dict[str, list[np.ndarray]] = {}
    for body in geometry.geometryObjects:
        if not hasattr(body.geometry, "tri_indices"):
            continue  # A primitive, which is drawn as such.
        link = model.frames[body.parentFrame]
        T_link_body = link.placement.inverse() * body.placement
        vertices = np.array([body.geometry.vertex(k) for k in range(body.geometry.num_vertices)])
        placed = vertices * body.meshScale @ T_link_body.rotation.T + T_link_body.translation
        corners.setdefault(link.name, []).append(placed)
    return tuple(_hull(link, np.concatenate(parts)) for link, parts in corners.items())


def _hull(link: str, corners: Float64[np.ndarray, "k 3"]) -> MeshHull:
    from scipy.spatial import ConvexHull

    coarse = np.unique(np.round(corners / GRID), axis=0) * GRID
    # Joggled: rounded corners lie in common planes.
    hull = ConvexHull(coarse, qhull_options="QJ")
    used, triangles = np.unique(hull.simplices, return_inverse=True)
    faces = triangles.reshape(-1, 3).astype(np.int32)
    points = coarse[used]
    first, second, third = (points[faces[:, k]] for k in range(3))
    normals = np.cross(second - first, third - first)
    inward = np.sum(normals * (first - points.mean(axis=0)), axis=1) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return MeshHull(link, points, faces[np.linalg.norm(normals, axis=1) > 0.0])
