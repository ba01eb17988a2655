"""A whole scenario: what its sections mean together."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
from jaxtyping import Float64

from lariat.geometry import obstacles as geometry
from lariat.geometry import polylines, poses
from lariat.geometry.cameras import looking_at
from lariat.geometry.poses import Pose
from shared.configuration import Bounds, ConfigurationError
from shared.scenario.sections import (
    Control,
    End,
    Ends,
    Event,
    Limits,
    Obstacle,
    Plant,
    Quaternion,
    Rope,
    Run,
    Sensing,
    Shape,
    Side,
)
from shared.version import SCENARIO_VERSION

LEVEL = np.array([0.5, 0.5, 0.5, 0.5])
"""The grip that points along world x: its z is x, its x is y, its y is z."""


@dataclass(frozen=True)
class Scenario:
    """A whole scenario file."""

    name: str
    rope: Rope
    start: Shape
    goal: Shape
    description: str = ""
    version: Annotated[int, Bounds(1, SCENARIO_VERSION)] = SCENARIO_VERSION
    """Version of the file's keys; a file of a newer version is refused."""
    seed: int = 0
    plant: Plant = Plant()
    ends: Ends = Ends()
    table: bool = True
    """Whether z = 0 is a table."""
    obstacles: tuple[Obstacle, ...] = ()
    sensing: Sensing = Sensing()
    control: Control = Control()
    limits: Limits = Limits()
    run: Run = Run()
    events: tuple[Event, ...] = ()
    folder: Path = field(default=Path(), compare=False)
    """Where the file lies; CSV files are sought there."""
    text: str = field(default="", compare=False, repr=False)
    """The file itself, for recordings."""

    @property
    def bodies(self) -> tuple[geometry.Obstacle, ...]:
        """All obstacles, the table among them."""
        listed = tuple(o.body(k) for k, o in enumerate(self.obstacles))
        return (geometry.TABLE, *listed) if self.table else listed

    @property
    def marked(self) -> dict[str, Obstacle]:
        """Obstacles, by name, whose place a camera sees by their markers."""
        if self.sensing.source != "camera":
            return {}
        named = ((o.body(k).name, o) for k, o in enumerate(self.obstacles))
        return {name: o for name, o in named if o.marker is not None}

    @property
    def plant_rope(self) -> Rope:
        """The true rope."""
        given = {k: v for k, v in vars(self.plant.rope).items() if v is not None}
        return Rope(
            **{**vars(self.rope), **{k: v for k, v in given.items() if k in vars(self.rope)}}
        )

    @property
    def camera_pose(self) -> Pose:
        """T_world_camera as far as is known."""
        s = self.sensing
        if s.orientation is None:
            return looking_at(s.position, s.look_at)
        return Pose(np.array(s.position), poses.normalized(np.array(s.orientation)))

    def end(self, side: Side) -> End:
        """What holds one end."""
        return getattr(self.ends, side)

    def nodes(self, shape: Shape) -> Float64[np.ndarray, "n 3"] | None:
        """The nodes of a shape that is given by nodes, resampled to the rope's count [m].

        Raises:
            ConfigurationError: The file is missing or holds no chain.
        """
        if not shape.nodes:
            return None
        return polylines.resample(_chain(self.folder / shape.nodes), self.rope.node_count)

    def grips(self, shape: Shape) -> tuple[Pose, Pose]:
        """The gripper poses of a shape: left and right, z along the rope from left to right.

        An orientation that is not given points along the rope with the least rotation from
        z = world x, the right one without twist against the left one.
        """
        nodes = self.nodes(shape)
        if nodes is None:
            left, right = np.array(shape.line)
            first = last = poses.normalized(right - left)
        else:
            left, right = nodes[0], nodes[-1]
            first, last = poses.normalized(nodes[1] - left), poses.normalized(right - nodes[-2])
        return (
            Pose(left, _orientation(shape.left_orientation, first)),
            Pose(right, _orientation(shape.right_orientation, last)),
        )


def _orientation(given: Quaternion | None, direction: np.ndarray) -> Float64[np.ndarray, "4"]:
    if given is not None:
        return poses.normalized(np.array(given))
    return poses.multiply(poses.rotation_between(np.array([1.0, 0.0, 0.0]), direction), LEVEL)


def _chain(path: Path) -> Float64[np.ndarray, "n 3"]:
    try:
        nodes = np.loadtxt(path, delimiter=",", comments="#", ndmin=2)
    except (OSError, ValueError) as error:
        raise ConfigurationError(f"cannot read nodes {path}: {error}") from error
    if nodes.ndim != 2 or nodes.shape[1] != 3 or len(nodes) < 3:
        raise ConfigurationError(
            f"{path} has shape {nodes.shape}; it takes at least 3 rows of x, y, z [m]"
        )
    if not np.all(np.isfinite(nodes)):
        raise ConfigurationError(f"{path} holds a number that is not finite")
    if polylines.length(nodes) <= 0.0:
        raise ConfigurationError(f"all nodes of {path} are the same point")
    return nodes
