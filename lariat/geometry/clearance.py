"""Which points of a rope or a gripper come near obstacles, and which way is out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

from lariat.geometry.normals import normals
from lariat.geometry.obstacles import Obstacle, signed_distance
from lariat.geometry.poses import Pose, rotate


@dataclass(frozen=True)
class Near:
    """Pairs of a point and an obstacle nearer than some reach."""

    points: Int64[np.ndarray, "a"]
    """Index of the point."""
    distances: Float64[np.ndarray, "a"]
    """To the obstacle's surface, negative inside [m]."""
    normals: Float64[np.ndarray, "a 3"]
    """Away from the obstacle."""


def near(
    points: Float64[np.ndarray, "p 3"],
    obstacles: Sequence[Obstacle],
    reach: Float64[np.ndarray, "p"],
) -> Near:
    """All pairs that are nearer than the reach of their point [m]."""
    indices, distances, outward = [], [], []
    for obstacle in obstacles:
        distance = signed_distance(points, obstacle)
        (inside,) = np.nonzero(distance < reach)
        if len(inside):
            indices.append(inside)
            distances.append(distance[inside])
            outward.append(normals(points[inside], obstacle))
    if not indices:
        return Near(np.zeros(0, dtype=int), np.zeros(0), np.zeros((0, 3)))
    return Near(np.concatenate(indices), np.concatenate(distances), np.concatenate(outward))


def with_midpoints(nodes: Float64[np.ndarray, "*b n 3"]) -> Float64[np.ndarray, "*b m 3"]:
    """Nodes, then the middles between them: a chain's distance is taken at both."""
    return np.concatenate([nodes, 0.5 * (nodes[..., 1:, :] + nodes[..., :-1, :])], axis=-2)


def swept_gripper_points(
    positions: Float64[np.ndarray, "s 2 3"],
    orientations: Float64[np.ndarray, "s 2 4"],
    reach: float,
) -> Float64[np.ndarray, "p 3"]:
    """`gripper_points` of one pair of poses after the other [m]."""
    axes = rotate(orientations, np.broadcast_to(np.array([0.0, 0.0, 1.0]), positions.shape))
    outwards = np.array([-1.0, 1.0])[:, None, None]
    along = reach * np.array([0.0, 0.5, 1.0])[:, None]
    points = positions[:, :, None, :] + outwards * along * axes[:, :, None, :]
    return points.reshape(-1, 3)


def grippers_apart(
    positions: Float64[np.ndarray, "s 2 3"],
    orientations: Float64[np.ndarray, "s 2 4"],
    reach: float,
) -> tuple[Float64[np.ndarray, "s"], Float64[np.ndarray, "s 3"]]:
    """Distance of the axes of both grippers' capsules [m], and the direction from left to right."""
    points = swept_gripper_points(positions, orientations, reach).reshape(-1, 2, 3, 3)
    ways = (points[:, 1, None] - points[:, 0, :, None]).reshape(len(points), -1, 3)
    distances = np.linalg.norm(ways, axis=-1)
    at = np.arange(len(points)), np.argmin(distances, axis=1)
    return distances[at], ways[at] / np.maximum(distances[at], 1e-9)[:, None]


def gripper_points(left: Pose, right: Pose, reach: float) -> Float64[np.ndarray, "6 3"]:
    """Points on the axes of both grippers' capsules, which point away from the rope [m].

    Three on the left one from the grip outwards, then three on the right one.

    Args:
        reach: From a grip to the centre of its capsule's far cap, which rounds it off [m].
    """
    along = reach * np.array([0.0, 0.5, 1.0])[:, None]
    axes = [rotate(p.orientation, np.array([0.0, 0.0, 1.0])) for p in (left, right)]
    return np.concatenate([left.position - along * axes[0], right.position + along * axes[1]])
