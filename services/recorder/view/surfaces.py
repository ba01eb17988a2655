"""Points on the surfaces of obstacles."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from services.recorder.view.primitives import HALF_SPACE_SIDE, half_space_pose

POINT_SPACING = 0.01
"""Distance between neighbouring points [m], where the body is small enough."""
MAX_POINTS_PER_LINE = 40
"""Most points in a row of a face or in a ring."""

Points = Float64[np.ndarray, "n 3"]
"""Points in the world or in the obstacle's frame [m]."""


def surface_points(obstacle: Obstacle) -> Points:
    """Return points on the surface of an obstacle, in the world."""
    if obstacle.shape == "half_space":
        line = _line(HALF_SPACE_SIDE)
        return half_space_pose(obstacle).apply(_grid(line, line))
    pose = Pose(np.array(obstacle.position), np.array(obstacle.orientation))
    return pose.apply(_local_points(obstacle))


def _local_points(obstacle: Obstacle) -> Points:
    match obstacle.shape:
        case "box":
            return _box(obstacle.size)
        case "sphere":
            return _sphere(obstacle.radius)
        case "cylinder":
            return _cylinder(obstacle.radius, obstacle.height)
        case "capsule":
            cap = _sphere(obstacle.radius)
            half = np.array([0.0, 0.0, obstacle.height / 2.0])
            top, bottom = cap[cap[:, 2] >= 0.0] + half, cap[cap[:, 2] <= 0.0] - half
            return np.concatenate([top, _tube(obstacle.radius, obstacle.height), bottom])
        case _:
            mesh = obstacle.row.mesh(obstacle.packed_sizes)
            points = np.concatenate([_inside(mesh.points[t]) for t in mesh.triangles])
            return np.unique(points.round(12), axis=0)


def _inside(corners: Float64[np.ndarray, "3 3"]) -> Points:
    """Return points of a triangle, its corners among them."""
    first, second = corners[1:] - corners[0]
    a, b = (len(_line(float(np.linalg.norm(edge)))) for edge in (first, second))
    shares = np.stack(np.meshgrid(np.linspace(0, 1, a), np.linspace(0, 1, b)), axis=-1)
    shares = shares.reshape(-1, 2)[shares.reshape(-1, 2).sum(axis=1) < 1.0 + 1e-9]
    return corners[0] + shares @ np.stack([first, second])


def _box(size: tuple[float, float, float]) -> Points:
    faces = []
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        face = _grid(*(_line(size[k]) for k in others))
        for side in (-0.5, 0.5):
            points = np.empty_like(face)
            points[:, others] = face[:, :2]
            points[:, axis] = side * size[axis]
            faces.append(points)
    return np.concatenate(faces)


def _cylinder(radius: float, height: float) -> Points:
    line = _line(2.0 * radius)
    lid = _grid(line, line)
    lid = lid[np.hypot(lid[:, 0], lid[:, 1]) <= radius]
    half = np.array([0.0, 0.0, height / 2.0])
    return np.concatenate([_tube(radius, height), lid + half, lid - half])


def _tube(radius: float, height: float) -> Points:
    angles, heights = np.meshgrid(_angles(radius), _line(height))
    x, y = radius * np.cos(angles), radius * np.sin(angles)
    return np.stack([x, y, heights], axis=-1).reshape(-1, 3)


def _sphere(radius: float) -> Points:
    azimuths = _angles(radius)
    polars = np.linspace(0.0, np.pi, len(azimuths) // 2 + 1)
    azimuth, polar = np.meshgrid(azimuths, polars)
    x, y = np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth)
    return radius * np.stack([x, y, np.cos(polar)], axis=-1).reshape(-1, 3)


def _angles(radius: float) -> Float64[np.ndarray, "k"]:
    count = int(np.clip(2.0 * np.pi * radius / POINT_SPACING, 8, MAX_POINTS_PER_LINE))
    return np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)


def _line(length: float) -> Float64[np.ndarray, "k"]:
    count = int(np.clip(length / POINT_SPACING, 1, MAX_POINTS_PER_LINE - 1)) + 1
    return np.linspace(-0.5 * length, 0.5 * length, count)


def _grid(first: Float64[np.ndarray, "a"], second: Float64[np.ndarray, "b"]) -> Points:
    x, y = np.meshgrid(first, second)
    return np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
