"""Pose of a camera from images of a marker that an arm carries.

The arm's pose gives the marker's corners in the world. The camera's pose minimises their
reprojection errors (Gauss-Newton, outliers with less weight). A marker that is carried without
rotation cannot distinguish an error of its pose on the flange from one of the camera's position.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.cameras import Camera, Intrinsics
from lariat.geometry.poses import Pose


@dataclass(frozen=True)
class SolverSettings:
    """Robustness and convergence of the calibration."""

    max_iterations: int = 50
    """Largest number of Gauss-Newton iterations."""
    linear_error: float = 1.0
    """Reprojection error above which the cost is linear [pixels]."""
    difference_step: float = 1e-6
    """Step of the numeric Jacobian [rad] and [m]."""
    tolerance: float = 1e-10
    """Length of a step below which the iteration has converged [rad] and [m]."""


@dataclass(frozen=True)
class MarkerView:
    """Marker in one image."""

    corners: Float64[np.ndarray, "4 3"]
    """Corners in the world, from the arm's pose [m]; clockwise from the upper left one."""
    pixels: Float64[np.ndarray, "4 2"]
    """Column and row of each corner."""


@dataclass(frozen=True)
class Extrinsics:
    """Calibrated pose of a camera, with its uncertainty."""

    T_world_camera: Pose
    """Pose of the optical frame in the world."""
    residual: float
    """Root mean square reprojection error of a coordinate [pixels]."""
    worst: float
    """Largest reprojection error of a corner [pixels]."""
    residual_length: float
    """Residual at the mean distance of the markers [m]."""
    position_deviation: Float64[np.ndarray, "3"]
    """Standard deviation of the position [m]."""
    rotation_deviation: Float64[np.ndarray, "3"]
    """Standard deviation of the rotation about the world's axes [rad]."""


def estimate_extrinsics(
    views: Sequence[MarkerView],
    intrinsics: Intrinsics,
    guess: Pose,
    settings: SolverSettings | None = None,
) -> Extrinsics:
    """Return the camera's pose with the least reprojection errors.

    Args:
        views: Marker at several places.
        intrinsics: Intrinsics of the camera.
        guess: Initial T_world_camera.
        settings: Robustness and convergence.
    """
    s = settings or SolverSettings()
    corners = np.concatenate([v.corners for v in views])
    pixels = np.concatenate([v.pixels for v in views])
    pose = guess
    hessian = np.eye(6)
    for _ in range(s.max_iterations):
        errors = _errors(pose, intrinsics, corners, pixels)
        jacobian = np.stack(
            [
                (
                    _errors(_moved(pose, s.difference_step * unit), intrinsics, corners, pixels)
                    - errors
                )
                / s.difference_step
                for unit in np.eye(6)
            ],
            axis=1,
        )
        size = np.repeat(np.linalg.norm(errors.reshape(-1, 2), axis=1), 2)
        weight = np.minimum(1.0, s.linear_error / np.maximum(size, 1e-12))
        hessian = jacobian.T @ (weight[:, None] * jacobian)
        step = np.linalg.solve(
            hessian + 1e-9 * np.diag(np.diag(hessian)), -jacobian.T @ (weight * errors)
        )
        pose = _moved(pose, step)
        if np.linalg.norm(step) < s.tolerance:
            break
    errors = _errors(pose, intrinsics, corners, pixels)
    residual = float(np.sqrt(np.mean(errors**2)))
    # Errors of one marker's corners are correlated: views count, not corners.
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
    """Reprojection errors of all coordinates [pixels]."""
    return (Camera(intrinsics, pose).project(corners)[0] - pixels).ravel()


def _moved(pose: Pose, step: Float64[np.ndarray, "6"]) -> Pose:
    """Pose after a rotation [rad] and a translation [m] in the world."""
    turn = poses.exponential(step[:3])
    return Pose(pose.position + step[3:], poses.multiply(turn, pose.orientation))
