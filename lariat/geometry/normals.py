"""Outward normals of obstacles: gradients of signed distances."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle


def outward_normals(
    points: Float64[np.ndarray, "p 3"], obstacle: Obstacle
) -> Float64[np.ndarray, "p 3"]:
    """Return the gradient of `signed_distance` at points: unit vectors away from the obstacle.

    Those of a region to keep in point into it.

    On edges, axes and centres, where the gradient is not unique, it is one of the limits nearby.

    Args:
        points: Points in the world frame [m].
        obstacle: One obstacle.
    """
    orientation = np.array(obstacle.orientation)
    local = poses.rotate(
        poses.conjugate(orientation), np.asarray(points, float) - np.array(obstacle.position)
    )
    match obstacle.shape:
        case "sphere":
            gradient = _unit(local)
        case "half_space":
            gradient = np.broadcast_to(poses.normalized(np.array(obstacle.normal)), local.shape)
        case "capsule":
            half = obstacle.height / 2.0
            axis = np.zeros_like(local)
            axis[:, 2] = np.clip(local[:, 2], -half, half)
            gradient = _unit(local - axis)
        case "cylinder":
            across = _unit(local * np.array([1.0, 1.0, 0.0]))
            along = np.zeros_like(local)
            along[:, 2] = np.where(local[:, 2] < 0.0, -1.0, 1.0)
            radial = np.hypot(local[:, 0], local[:, 1]) - obstacle.radius
            axial = np.abs(local[:, 2]) - obstacle.height / 2.0
            corner = np.maximum(radial, 0.0)[:, None] * across
            corner = _unit(corner + np.maximum(axial, 0.0)[:, None] * along)
            face = np.where((radial > axial)[:, None], across, along)
            gradient = np.where(((radial > 0.0) & (axial > 0.0))[:, None], corner, face)
        case "box":
            excess = np.abs(local) - np.array(obstacle.size) / 2.0
            signs = np.where(local < 0.0, -1.0, 1.0)
            face = signs * np.eye(3)[np.argmax(excess, axis=1)]
            outside = np.max(excess, axis=1) > 0.0
            gradient = np.where(outside[:, None], _unit(signs * np.maximum(excess, 0.0)), face)
    return poses.rotate(orientation, -gradient if obstacle.keep_in else gradient)


def _unit(vectors: Float64[np.ndarray, "p 3"]) -> Float64[np.ndarray, "p 3"]:
    sizes = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(sizes > 1e-12, vectors / np.maximum(sizes, 1e-12), np.array([1.0, 0.0, 0.0]))
