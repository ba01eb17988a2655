"""Scenario: all sections of a file, and quantities derived from several of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, is_dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from jaxtyping import Bool, Float64

from lariat.configuration import Bounds, ConfigurationError
from lariat.files.bounded_file import path_inside, read_file
from lariat.geometry import obstacles as geometry
from lariat.geometry import polylines, poses
from lariat.geometry.cable_routes import (
    RouteStop,
    fitted_ends,
    laid_chain,
    stops_of,
    tail_directions,
)
from lariat.geometry.obstacle_motion import ObstacleMotion
from lariat.geometry.poses import Pose
from lariat.scenario.cameras import CameraSetup, PlacedCamera, camera_setups
from lariat.scenario.distractors import Distractor
from lariat.scenario.goal_table import checked_nodes, grip_orientation, read_nodes
from lariat.scenario.sections import (
    SIDES,
    Clip,
    Control,
    End,
    Ends,
    Event,
    Limits,
    Obstacle,
    Plant,
    Recording,
    Region,
    Rope,
    Ros2,
    Run,
    Sensing,
    Shape,
    Side,
)

SCENARIO_VERSION = 1
"""Version of the keys of scenario files."""
MAX_NODES_FILE_SIZE = 4 * 2**20
"""Largest CSV file of nodes [bytes]."""
MAX_LENGTH_ERROR = 0.03
"""Largest deviation of a shape's length from that of what it describes, relative to this [-]."""
CUT_REFINEMENT = 4
"""Nodes into which each node of a whole rope's shape is resampled before a part is cut out [-]."""
MAX_NAME_LENGTH = 100
"""Largest number of characters of a scenario's name, which names its recordings."""
PLANT_EDGES = 3
"""Edges of the simulated rope for each edge of the controller's, by default [-]."""
LIVE_PLANT_EDGES = {"rod": 3, "mujoco": 2, "links": 1}
"""The same in a live stack by `plant.model`: what two cores simulate in real time [-]."""


@dataclass(frozen=True)
class Scenario:
    """Content of a scenario file."""

    name: str
    """Name of the scenario."""
    rope: Rope
    """Rope between the grips: `length` is without what lies in the grippers."""
    start: Shape
    goal: Shape
    description: str = ""
    """One line on its purpose."""
    version: Annotated[int, Bounds(1, SCENARIO_VERSION)] = SCENARIO_VERSION
    """Version of the file's keys; a file of a newer version is refused."""
    seed: int = 0
    """Seed of all random numbers."""
    plant: Plant = Plant()
    ends: Ends = Ends()
    table: bool = True
    """Whether there is a table at z = 0."""
    obstacles: tuple[Obstacle, ...] = ()
    clips: tuple[Clip, ...] = ()
    keep_in: tuple[Region, ...] = ()
    """Regions that the rope must not leave; a run does not change them."""
    sensing: Sensing = Sensing()
    cameras: dict[str, PlacedCamera] = field(default_factory=dict, hash=False)
    """Cameras by name, if there are several; by default the one that `[sensing]` places."""
    control: Control = Control()
    limits: Limits = Limits()
    run: Run = Run()
    recording: Recording = Recording()
    ros2: Ros2 = Ros2()
    next_goals: tuple[Shape, ...] = ()
    """Goals that follow `goal` in a run, each when the rope rests at the one before it."""
    events: tuple[Event, ...] = ()
    distractors: tuple[Distractor, ...] = ()
    folder: Path = field(default=Path(), compare=False)
    """Folder of the file and its CSV files."""
    text: str = field(default="", compare=False, repr=False)
    """Text of the file, for recordings."""

    def __post_init__(self) -> None:
        if not 1 <= len(self.name) <= MAX_NAME_LENGTH or not self.name.isprintable():
            raise ValueError(
                f"name = {self.name[:60]!r} has {len(self.name)} characters; give 1 to "
                f"{MAX_NAME_LENGTH} in one line, of which recordings have their names"
            )

    @property
    def simulated(self) -> bool:
        """Whether no driver of the cell can reach hardware."""
        return not any(self.end(side).reaches_hardware for side in SIDES)

    @property
    def shape_files(self) -> tuple[str, ...]:
        """Names of the CSV files of all its shapes, each once."""
        return tuple(dict.fromkeys(shape.file for shape in _shapes_of(self) if shape.file))

    @property
    def bodies(self) -> tuple[geometry.Obstacle, ...]:
        """Obstacles and legs of clips as geometric bodies, with the table."""
        listed = tuple(o.body(k) for k, o in enumerate(self.obstacles))
        listed += tuple(leg for clip in self.clips for leg in clip.bodies)
        return (geometry.TABLE, *listed) if self.table else listed

    @property
    def regions(self) -> tuple[geometry.Obstacle, ...]:
        """Regions that the rope must not leave, as obstacles for the rope alone."""
        return tuple(region.body(k) for k, region in enumerate(self.keep_in))

    @property
    def marked_obstacles(self) -> dict[str, Obstacle]:
        """Obstacles by name whose poses perception finds by their markers."""
        if self.sensing.source != "camera":
            return {}
        named = ((o.body(k).name, o) for k, o in enumerate(self.obstacles))
        return {name: o for name, o in named if o.marker is not None}

    def obstacle_motions(self, start: float = 0.0) -> tuple[ObstacleMotion, ...]:
        """Return the motions of the obstacles that have a path.

        Args:
            start: Start of the run [s].
        """
        named = ((o.body(k).name, o) for k, o in enumerate(self.obstacles))
        return tuple(o.motion(name, start) for name, o in named if o.path)

    @property
    def held_length(self) -> float:
        """Length of the rope that lies in both grippers [m]."""
        return self.ends.left.grip_length + self.ends.right.grip_length

    @property
    def plant_rope(self) -> Rope:
        """Rope of the simulation between its grips: `rope` with the differences in `plant.rope`."""
        hidden = self.plant.rope
        own = vars(self.rope) | {"node_count": PLANT_EDGES * (self.rope.node_count - 1) + 1}
        differences = {k: v for k, v in vars(hidden).items() if k in own and v is not None}
        if hidden.length is not None:
            differences["length"] = hidden.length - self.held_length
        if hidden.yield_curvature or hidden.bending_radius:
            own |= {"yield_curvature": None, "bending_radius": None}
        return Rope(**own | differences)

    @property
    def live(self) -> Scenario:
        """The scenario with a simulated rope for real time, where it leaves its nodes open."""
        if self.plant.rope.node_count is not None:
            return self
        edges = LIVE_PLANT_EDGES[self.plant.model] * (self.rope.node_count - 1)
        rope = replace(self.plant.rope, node_count=edges + 1)
        return replace(self, plant=replace(self.plant, rope=rope))

    @property
    def camera_setups(self) -> tuple[CameraSetup, ...]:
        """Cameras of the cell, at least one, in the order of the file."""
        return camera_setups(self.sensing, self.cameras)

    @property
    def moves(self) -> Bool[np.ndarray, "2 6"]:
        """Components of each grip's velocity that the ends can move."""
        moves = np.zeros((2, 6), dtype=bool)
        for row, side in zip(moves, SIDES, strict=True):
            row[:3] = self.end(side).driver != "fixed"
            row[3:] = self.end(side).rotates
        return moves

    def end(self, side: Side) -> End:
        """Return the arm at one end."""
        return getattr(self.ends, side)

    def nodes(self, shape: Shape) -> Float64[np.ndarray, "n 3"] | None:
        """Return the nodes of a shape [m], resampled to the rope's number of nodes.

        Returns:
            None for a shape that is given by its grips, or by a part of the rope.

        Raises:
            ConfigurationError: The CSV file is missing or invalid.
        """
        if not shape.nodes or shape.part is not None:
            return None
        return polylines.resample_smooth(_chain(self.folder, shape), self.rope.node_count)

    def part_nodes(self, shape: Shape) -> Float64[np.ndarray, "m 3"] | None:
        """Return the nodes of a shape of a part of the rope [m], as its file has them.

        Of a file with the whole rope, which its length tells, the part is cut out.

        Returns:
            None for a shape of the whole rope, or given by its grips.

        Raises:
            ConfigurationError: The CSV file is missing or invalid.
        """
        if not shape.leaves_grips_open or shape.part is None:
            return None
        nodes = _chain(self.folder, shape)
        fine = polylines.resample_smooth(nodes, CUT_REFINEMENT * len(nodes))
        scale = polylines.length(fine) / self.rope.length
        if abs(scale - 1.0) > MAX_LENGTH_ERROR:
            return nodes
        return polylines.cut(fine, scale * shape.part[0], scale * shape.part[1])

    def laid_nodes(self, shape: Shape) -> Float64[np.ndarray, "n 3"]:
        """Return the nodes of a rope that lies along the route of a shape, before it rests [m].

        Raises:
            ConfigurationError: The route names something that is not there, or the rope is too
                short for it.
        """
        rope, ends = self.rope, np.array([grip.position for grip in self.grips(shape)])
        try:
            return laid_chain(self.route_stops(shape), ends, rope.length, rope.node_count)[0]
        except ValueError as error:
            raise ConfigurationError(str(error)) from error

    def route_stops(
        self, shape: Shape, obstacles: Sequence[geometry.Obstacle] | None = None
    ) -> tuple[RouteStop, ...]:
        """Return the stops of the route of a shape.

        Args:
            shape: Shape with a route.
            obstacles: Obstacles, with the legs of clips; by default `bodies`.

        Raises:
            ConfigurationError: The route names something that is not there.
        """
        radius = self.rope.diameter / 2.0
        try:
            bodies = self.bodies if obstacles is None else obstacles
            return stops_of(shape.route, bodies, np.array(shape.line), radius)
        except ValueError as error:
            raise ConfigurationError(str(error)) from error

    def grips(
        self, shape: Shape, obstacles: Sequence[geometry.Obstacle] | None = None
    ) -> tuple[Pose, Pose]:
        """Return the left and the right grip pose of a shape, z along the rope from left to right.

        A default orientation points along the rope, that of an end of a route level. The nodes of a
        part of the rope do not tell the grips: those of the start stand in their place.

        Args:
            shape: Shape.
            obstacles: Obstacles along which a route leads; by default `bodies`.

        Raises:
            ConfigurationError: The CSV file is missing or invalid.
        """
        if shape.leaves_grips_open:
            return self.grips(self.start)
        if not shape.nodes:
            left, right = np.array(shape.line)
            first = last = poses.normalized(right - left)
            if shape.route:
                stops, ends = self.route_stops(shape, obstacles), np.array(shape.line)
                left, right = fitted_ends(stops, ends, self.rope.length)
                first, last = tail_directions(stops, np.array([left, right]))
        else:
            nodes = _chain(self.folder, shape)
            left, right = nodes[0], nodes[-1]
            first, last = polylines.end_tangents(nodes)
        return (
            Pose(left, grip_orientation(first, shape.left_orientation)),
            Pose(right, grip_orientation(last, shape.right_orientation)),
        )


def _shapes_of(value: Any) -> Iterator[Shape]:
    """Yield every shape in a section, wherever its fields hold one."""
    if isinstance(value, Shape):
        yield value
    elif isinstance(value, tuple):
        for item in value:
            yield from _shapes_of(item)
    elif is_dataclass(value):
        for item in vars(value).values():
            yield from _shapes_of(item)


def _chain(folder: Path, shape: Shape) -> Float64[np.ndarray, "n 3"]:
    try:
        if not shape.file:
            return checked_nodes(shape.scale * np.array(shape.nodes))
        path = path_inside(folder, shape.file)
        return read_nodes(read_file(path, MAX_NODES_FILE_SIZE), shape.scale)
    except (OSError, ValueError) as error:
        name = folder / shape.file if shape.file else f"of {len(shape.nodes)} rows"
        raise ConfigurationError(f"cannot read nodes {name}: {error}") from error
