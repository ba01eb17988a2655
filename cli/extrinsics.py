"""Where a camera stands, from what it sees of a marker that an arm carries about.

The marker's corners are known in the world through the arm's pose; the camera's pose is the one
that projects them to where they are seen: Gauss-Newton on reprojection errors, outliers weighed
down. A marker that is only carried and never turned cannot tell an error of its place on the flange
from one of the camera's place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.cameras import Camera, Intrinsics
from lariat.geometry.poses import Pose

ITERATIONS = 50
OUTLIER = 1.0
"""Reprojection errors beyond this count linearly [pixels]."""
STEP = 1e-6
"""Of the numeric Jacobian [rad, m]."""


@dataclass(frozen=True)
class View:
    """One sighting of the marker."""

    corners: Float64[np.ndarray, "4 3"]
    """In the world, by the arm [m]; clockwise from the upper left one."""
    pixels: Float64[np.ndarray, "4 2"]
    """Where they are seen."""


@dataclass(frozen=True)
class Extrinsics:
    """A calibrated pose and how far it can be trusted."""

    T_world_camera: Pose
    residual: float
    """Root mean square reprojection error of a coordinate [pixels]."""
    worst: float
    """Largest distance of a corner from where it should be seen [pixels]."""
    residual_length: float
    """The residual at the markers' distance [m]."""
    position_deviation: Float64[np.ndarray, "3"]
    """Standard deviation of the position [m]."""
    rotation_deviation: Float64[np.ndarray, "3"]
    """Standard deviation of the rotation about the world's axes [rad]."""


def solve(views: Sequence[View], intrinsics: Intrinsics, guess: Pose) -> Extrinsics:
    """The pose that explains all views.

    Args:
        views: Sightings at several places.
        intrinsics: Of the camera.
        guess: T_world_camera as far as is known.
    """
    corners = np.concatenate([v.corners for v in views])
    pixels = np.concatenate([v.pixels for v in views])
    pose = guess
    hessian = np.eye(6)
    for _ in range(ITERATIONS):
        errors = _errors(pose, intrinsics, corners, pixels)
        jacobian = np.stack(
            [
                (_errors(_moved(pose, STEP * unit), intrinsics, corners, pixels) - errors) / STEP
                for unit in np.eye(6)
            ],
            axis=1,
        )
        size = np.repeat(np.linalg.norm(errors.reshape(-1, 2), axis=1), 2)
        weight = np.minimum(1.0, OUTLIER / np.maximum(size, 1e-12))
        hessian = jacobian.T @ (weight[:, None] * jacobian)
        step = np.linalg.solve(
            hessian + 1e-9 * np.diag(np.diag(hessian)), -jacobian.T @ (weight * errors)
        )
        pose = _moved(pose, step)
        if np.linalg.norm(step) < 1e-10:
            break
    errors = _errors(pose, intrinsics, corners, pixels)
    residual = float(np.sqrt(np.mean(errors**2)))
    # Corners of one marker err together: sightings count, not corners.
    spread = residual * np.sqrt(4.0 * np.diag(np.linalg.inv(hessian)))
    depth = Camera(intrinsics, pose).project(corners)[1]
    return Extrinsics(
        pose,
        residual,
        float(np.max(np.linalg.norm(errors.reshape(-1, 2), axis=1))),
        residual * float(np.mean(depth)) / intrinsics.fx,
        spread[3:],
        spread[:3],
    )


def _errors(
    pose: Pose,
    intrinsics: Intrinsics,
    corners: Float64[np.ndarray, "k 3"],
    pixels: Float64[np.ndarray, "k 2"],
) -> Float64[np.ndarray, "e"]:
    return (Camera(intrinsics, pose).project(corners)[0] - pixels).ravel()


def _moved(pose: Pose, step: Float64[np.ndarray, "6"]) -> Pose:
    turn = poses.exponential(step[:3])
    return Pose(pose.position + step[3:], poses.multiply(turn, pose.orientation))
