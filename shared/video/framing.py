"""Camera from which a whole run is seen, free of text and of the inset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import Camera, Intrinsics, looking_at, poses
from lariat.geometry.obstacles import Obstacle
from shared.video.recorded_run import RecordedRun
from shared.video.surfaces import surface

VIEW_ANGLE = 0.75
"""Horizontal angle of view [rad]."""
AZIMUTH = -1.05
"""Usual angle of the camera about the vertical, from the x axis [rad]."""
SINGLE_ARM_DISTANCE = 0.2
"""Mean distance of an arm's bodies from the rope, along x, from which it is the only arm [m]."""
ELEVATION = 0.68
"""Angle of the camera above the horizon [rad]."""
NEAREST_DISTANCE = 0.4
"""Least distance of the camera from what it looks at [m]."""
DISTANCE_STEP = 1.04
"""Factor between the distances that are tried [-]."""
MAX_STEPS = 120
"""Largest number of distances that are tried."""
INSTANTS = 9
"""Number of instants of a run that have to be seen."""
Rectangle = tuple[float, float, float, float]
"""Left, upper, right and lower bound, as shares of the picture."""


@dataclass(frozen=True)
class Viewpoint:
    """Place of a camera, and the point in the middle of its picture."""

    eye: tuple[float, float, float]
    """Place of the camera [m]."""
    target: tuple[float, float, float]
    """Point in the middle of the picture [m]."""

    @property
    def distance(self) -> float:
        """Distance of the camera from its target [m]."""
        return float(np.linalg.norm(np.subtract(self.eye, self.target)))

    def camera(self, size: tuple[int, int]) -> Camera:
        """Return the camera of a picture of columns and rows."""
        return Camera(Intrinsics.symmetric(*size, VIEW_ANGLE), looking_at(self.eye, self.target))


def points_of(run: RecordedRun) -> Float64[np.ndarray, "p 3"]:
    """Return points of rope, goal, grippers, arms and obstacles throughout a run [m]."""
    parts: list[np.ndarray] = []
    bodies: set[Obstacle] = set()
    for time in np.linspace(0.0, run.duration, INSTANTS):
        instant = run.at(float(time))
        parts += [instant.nodes, instant.goal, *instant.grips, *instant.others]
        bodies.update(instant.obstacles, instant.arms)
    return np.concatenate([*parts, *(surface(body).points for body in bodies)])


def azimuth_of(run: RecordedRun) -> float:
    """Return the camera's angle about the vertical; a single arm stands behind the rope [rad]."""
    first = run.at(0.0)
    places = [body.position[0] for body in first.arms]
    aside = np.mean(places) - first.nodes[:, 0].mean() if places else 0.0
    return -np.pi - AZIMUTH if aside > SINGLE_ARM_DISTANCE else AZIMUTH


def frame(
    points: Float64[np.ndarray, "p 3"],
    size: tuple[int, int],
    azimuth: float,
    area: Rectangle,
    covered: Rectangle | None = None,
) -> Viewpoint:
    """Return the nearest viewpoint from which all points lie in a part of the picture.

    `azimuth` is the camera's angle about the vertical, from the x axis [rad]; `covered` is the part
    of the area that something else covers.
    """
    away = np.array(
        [
            np.cos(ELEVATION) * np.cos(azimuth),
            np.cos(ELEVATION) * np.sin(azimuth),
            np.sin(ELEVATION),
        ]
    )
    target = (points.min(0) + points.max(0)) / 2.0
    middle = np.array([area[0] + area[2], area[1] + area[3]]) / 2.0
    distance = NEAREST_DISTANCE
    for _ in range(MAX_STEPS):
        view = _view(target, distance * away)
        pixels, depth = view.camera(size).project(points)
        if depth.min() > 0.0:
            # The camera is moved sideways until the points are in the middle of the area.
            shares = pixels / size
            off = (shares.min(0) + shares.max(0)) / 2.0 - middle
            orientation = view.camera(size).T_world_camera.orientation
            right, down = poses.rotate(orientation, np.eye(3)[:2])
            across = 2.0 * distance * np.tan(VIEW_ANGLE / 2.0) * off * (1.0, size[1] / size[0])
            target = target + across[0] * right + across[1] * down
            view = _view(target, distance * away)
            shares = view.camera(size).project(points)[0] / size
            hidden = covered is not None and _inside(shares, covered).any()
            if _inside(shares, area).all() and not hidden:
                return view
        distance *= DISTANCE_STEP
    return _view(target, distance * away)


def _view(target: Float64[np.ndarray, "3"], offset: Float64[np.ndarray, "3"]) -> Viewpoint:
    (x, y, z), (u, v, w) = (target + offset).tolist(), target.tolist()
    return Viewpoint((x, y, z), (u, v, w))


def _inside(shares: Float64[np.ndarray, "p 2"], area: Rectangle) -> np.ndarray:
    return np.asarray(np.all((shares >= area[:2]) & (shares <= area[2:]), axis=1))
