"""Table of the node's topics, services and actions, with the changes of a scenario's `[ros2]`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario
from lariat.scenario.sections import Ros2
from lariat.suggestion import did_you_mean
from shared import topics
from shared.cell_description import WORLD_FRAME
from shared.ros2.outputs import Output, outputs
from shared.ros2.types import FOLLOW_TRAJECTORY, SHAPE_ROPE, TRIGGER
from shared.ros2.wire import LATCHED, Qos
from shared.topics import Topic

PROCESSES = ("sim", "camera", "perception", "planner", "controller", "robot_gateway", "recorder")
"""Processes whose health is shown."""
PLACEHOLDER = "NAME"
"""Part of a key that stands for the name of a camera."""


@dataclass(frozen=True)
class Endpoint:
    """Topic, service or action that no topic of the bus stands behind."""

    name: str
    """Name in ROS 2."""
    type: str
    """Type."""
    meaning: str
    """What it tells or does."""
    qos: Qos | None = None
    """Quality of service of a topic."""


DESCRIPTION = Endpoint("/robot_description", "std_msgs/msg/String", "URDF", LATCHED)
"""Topic of the cell's URDF."""
INPUTS = (
    Endpoint("goal", "geometry_msgs/msg/PoseArray",
             "goal: poses of both grips, or one for each node", Qos()),
    Endpoint("collision_object", "moveit_msgs/msg/CollisionObject",
             "obstacles: boxes, spheres, cylinders", Qos()),
    Endpoint("shape_rope", SHAPE_ROPE, "goal with feedback and result; a cancel stops the arms"),
    Endpoint("follow_joint_trajectory", FOLLOW_TRAJECTORY,
             "trajectory of an arm's joints, or of both arms'; a cancel stops it"),
    Endpoint("hold", TRIGGER, "stop the arms; a person at page or terminal lets them go on"),
    *(Endpoint(name, TRIGGER, f"{name} the run") for name in ("start", "pause", "stop", "reset")),
)  # fmt: skip
"""What commands the cell."""

Row = TypeVar("Row", Endpoint, Output)


class Table:
    """Names, frames, rates and qualities of one cell."""

    def __init__(
        self,
        settings: Ros2 | None = None,
        cameras: tuple[str, ...] = (),
        clock: Topic = topics.ROPE_TRUTH,
    ) -> None:
        """Create the table; the stamps of the topic `clock` are the simulated plant's time."""
        self.settings = settings or Ros2()
        self._cameras = cameras
        rows = outputs(clock)
        keys = [shown(row.name) for row in (*rows, DESCRIPTION, *INPUTS)]
        for key in self.settings.topics:
            if key not in keys:
                hint = did_you_mean(key, keys) or " lariat ros2 lists them"
                raise ConfigurationError(f"unknown topic {key!r} in [ros2.topics];{hint}")
        self.outputs = tuple(map(self._changed, rows))
        self.description = self._changed(DESCRIPTION)
        self.inputs = {row.name: self._changed(row) for row in INPUTS}
        self.sources = [(s, row) for row in self.outputs for s in self._sources_of(row.source)]
        """Topics of the bus, each with an output that stands for it."""
        self._check_names(rows)

    @classmethod
    def of(cls, scenario: Scenario) -> Table:
        """Return the table of a scenario's cell; see `Table`."""
        cameras = tuple(camera.name for camera in scenario.camera_setups)
        simulated = scenario.sensing.source == "camera" and not scenario.sensing.outside
        # Images, which are read anyway, have the stamps of the plant's truth.
        clock = topics.CAMERA_DEPTH.at(cameras[0]) if simulated else topics.ROPE_TRUTH
        return cls(scenario.ros2, cameras, clock)

    def frame(self, name: str) -> str:
        """Return the name in ROS 2 of a frame of the cell; no name stays none."""
        if name == WORLD_FRAME:
            return self.settings.world_frame
        return f"{self.settings.frame_prefix}{name}" if name else ""

    def converted(self, output: Output, message: Any) -> Any | None:
        """Return what stands for a message, with ROS 2's names of frames; None for nothing."""
        answer = output.convert(message)
        parts = [answer, *getattr(answer, "transforms", ()), *getattr(answer, "markers", ())]
        for part in parts:
            if hasattr(part, "header"):
                part.header.frame_id = self.frame(part.header.frame_id)
            if hasattr(part, "child_frame_id"):
                part.child_frame_id = self.frame(part.child_frame_id)
        return answer

    def recorded(self, key: str, message: Any) -> Iterator[tuple[Output, Any]]:
        """Yield what stands for a message of a recording, each with its row of the table."""
        for source, output in self.sources:
            if output.recorded and source.key == key:
                answer = self.converted(output, message)
                if answer is not None:
                    yield output, answer

    def urdf(self, text: str) -> str:
        """Return a cell's URDF with ROS 2's name of the world."""
        return text.replace(f'"{WORLD_FRAME}"', f'"{self.frame(WORLD_FRAME)}"')

    def _sources_of(self, source: Topic) -> list[Topic]:
        """Concrete topics of a source of the table."""
        if "{" not in source.key:
            return [source]
        names = PROCESSES if source in (topics.HEALTH, topics.LOG) else self._cameras
        return [source.at(name) for name in names]

    def _changed(self, row: Row) -> Row:
        key = shown(row.name)
        change = self.settings.topics.get(key)
        if change is None:
            return row
        quality = {
            field: value
            for field in ("reliable", "latched", "depth")
            if (value := getattr(change, field)) is not None
        }
        if quality and row.qos is None:
            raise ConfigurationError(
                f"[ros2.topics.{key}] {next(iter(quality))}: a service or action has only a name; "
                "remove it"
            )
        if row.qos is not None:
            row = replace(row, qos=replace(row.qos, **quality))
        if change.rate is not None:
            if not isinstance(row, Output):
                raise ConfigurationError(
                    f"[ros2.topics.{key}] rate = {change.rate}: it is not published repeatedly; "
                    "remove rate"
                )
            row = replace(row, rate=change.rate)
        if not change.name:
            return row
        filled = "{name}" if "{name}" in row.name else PLACEHOLDER
        return replace(row, name=change.name.replace(PLACEHOLDER, filled))

    def _check_names(self, rows: tuple[Output, ...]) -> None:
        """Check that no two topics get one name."""
        names = [(self.description.name, DESCRIPTION.name)]
        names += [(row.name, default) for default, row in self.inputs.items()]
        for before, row in zip(rows, self.outputs, strict=True):
            for source in self._sources_of(row.source):
                names.append((row.name_for(source.key), before.name_for(source.key)))
        owners: dict[str, str] = {}
        for name, default in names:
            whole = name if name.startswith("/") else f"{self.settings.namespace}/{name}"
            if owners.setdefault(whole, default) != default:
                raise ConfigurationError(
                    f"[ros2.topics] {owners[whole]} and {default} have one name, {whole!r}; give "
                    "each its own"
                )


def shown(name: str) -> str:
    """Return a name of the table as lists and scenarios have it."""
    return name.replace("{name}", PLACEHOLDER)
