"""Sections of obstacles and regions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from lariat.configuration import Bounds
from lariat.geometry import obstacles as geometry
from lariat.geometry import poses
from lariat.geometry.obstacle_motion import ObstacleMotion
from lariat.scenario.sections.quantities import Position, Quaternion, Vector
from lariat.shapes import SHAPES, ShapeName, SolidName


@dataclass(frozen=True)
class Waypoint:
    """Place of a moving obstacle at a time of a run."""

    time: Annotated[float, Bounds(0.001, 3600.0, "s")]
    """Time since the start of the run."""
    position: Position
    """Position of the obstacle at that time."""


@dataclass(frozen=True)
class Region:
    """Region that the rope must not leave; each one counts."""

    shape: SolidName
    """Shape of the region; cylinder, capsule and cone have their axis along z."""
    position: Position
    """Centre."""
    orientation: Quaternion = (1.0, 0.0, 0.0, 0.0)
    """Orientation in the world."""
    radius: Annotated[float, Bounds(1e-3, 20.0, "m")] | None = None
    """Radius of a cylinder, capsule, sphere or a cone's base."""
    height: Annotated[float, Bounds(1e-3, 20.0, "m")] | None = None
    """Height of a cylinder or cone (apex above); of a capsule, between the centres of its caps."""
    size: Annotated[Vector, Bounds(1e-3, 20.0, "m")] | None = None
    """Edge lengths of a box along x, y, z."""
    name: str = ""
    """Name, unique among regions and obstacles; by default keep-in and index."""

    def __post_init__(self) -> None:
        _check_sizes(self)

    def body(self, index: int) -> geometry.Obstacle:
        """Return the region as a geometric body of which the outside is the obstacle.

        Args:
            index: Index in the file, for the name of a region without one.
        """
        return replace(_body(self, f"keep-in-{index}"), keep_in=True)


@dataclass(frozen=True)
class Obstacle:
    """Obstacle that the rope must not touch, or support that it may lean on."""

    shape: ShapeName
    """Shape of the obstacle; cylinder, capsule and cone have their axis along z."""
    position: Position
    """Centre; of a half space, a point on its surface."""
    orientation: Quaternion = (1.0, 0.0, 0.0, 0.0)
    """Orientation in the world."""
    radius: Annotated[float, Bounds(1e-4, 10.0, "m")] | None = None
    """Radius of a cylinder, capsule, sphere or a cone's base."""
    height: Annotated[float, Bounds(1e-4, 10.0, "m")] | None = None
    """Height of a cylinder or cone (apex above); of a capsule, between the centres of its caps."""
    size: Annotated[Vector, Bounds(1e-4, 20.0, "m")] | None = None
    """Edge lengths of a box along x, y, z."""
    normal: Vector = (0.0, 0.0, 1.0)
    """Outward normal of a half space."""
    support: bool = False
    """Whether the rope may lean on it."""
    friction: Annotated[float, Bounds(0.0, 5.0)] = 0.0
    """Coefficient of friction that the model of the rope has on a support; the simulated rope has
    `plant.friction`."""
    name: str = ""
    """Name, unique in the scene; by default shape and index."""
    path: tuple[Waypoint, ...] = ()
    """Waypoints to which it moves from `position` in every run, along straight lines and at a
    constant speed on each; empty: it stands still."""
    marker: Annotated[int, Bounds(0, 49)] | None = None
    """Id of the ArUco marker (4x4_50) on its upper face."""
    marker_size: Annotated[float, Bounds(0.005, 1.0, "m")] = 0.04
    """Edge length of the marker's black square."""
    stands_at: Position | None = None
    """True position in simulation, found by the marker only; by default `position`."""
    stands_turned: Annotated[float, Bounds(-180.0, 180.0, "deg")] = 0.0
    """True rotation about the world's z in simulation."""

    def __post_init__(self) -> None:
        if self.marker is None and (self.stands_at is not None or self.stands_turned != 0.0):
            raise ValueError("stands_at and stands_turned need a marker by which they are found")
        _check_sizes(self)
        if self.friction > 0.0 and not self.support:
            raise ValueError(
                f"friction = {self.friction} has no effect without support = true: the rope must "
                "not touch other obstacles"
            )
        if np.linalg.norm(self.normal) < 1e-9:
            raise ValueError("normal must not be zero")
        if self.path:
            if self.support or self.marker is not None or self.shape == "half_space":
                raise ValueError("a support, a half space or a marked obstacle has no path")
            self.motion(self.name)

    def motion(self, name: str, start: float = 0.0) -> ObstacleMotion:
        """Return the motion along `path`.

        Args:
            name: Name of the obstacle's body.
            start: Start of the run [s].

        Raises:
            ValueError: Times do not increase, or the obstacle moves too fast.
        """
        return ObstacleMotion(
            name,
            (start, *(start + waypoint.time for waypoint in self.path)),
            (self.position, *(waypoint.position for waypoint in self.path)),
        )

    def body(self, index: int) -> geometry.Obstacle:
        """Return the obstacle as a geometric body.

        Args:
            index: Index in the file, for the name of an obstacle without one.
        """
        body = _body(self, f"{self.shape}-{index}")
        return replace(body, normal=self.normal, support=self.support, friction=self.friction)


def _body(of: Region | Obstacle, name: str) -> geometry.Obstacle:
    """Geometric body of a region or obstacle, with a name for one without."""
    return geometry.Obstacle(
        shape=of.shape,
        position=of.position,
        orientation=tuple(poses.normalized(np.array(of.orientation)).tolist()),
        radius=of.radius or 0.0,
        height=of.height or 0.0,
        size=of.size or (0.0, 0.0, 0.0),
        name=of.name or name,
    )


def _check_sizes(body: Region | Obstacle) -> None:
    for key in SHAPES[body.shape].fields:
        if getattr(body, key) is None:
            raise ValueError(f"a {body.shape} needs {key}")
    for key in ("radius", "height", "size"):
        if key not in SHAPES[body.shape].fields and getattr(body, key) is not None:
            raise ValueError(f"a {body.shape} has no {key}; remove it")
    if np.linalg.norm(body.orientation) < 1e-9:
        raise ValueError("orientation must not be zero")
