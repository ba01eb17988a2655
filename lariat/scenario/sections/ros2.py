"""Section of the node in ROS 2's graph."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Annotated

from lariat.configuration import Bounds

_NAME = re.compile(r"/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")
_NAME_RULE = "letters, digits and _ between single slashes"


@dataclass(frozen=True)
class Ros2Topic:
    """Changes to a topic, service or action that `lariat ros2` lists by the key NAME."""

    name: str = ""
    """Its name in ROS 2; with `NAME` where the key has one. Without leading slash, in the node's
    namespace."""
    rate: Annotated[float | None, Bounds(0.01, 1000.0, "Hz")] = None
    """Largest rate at which it is published live."""
    reliable: bool | None = None
    """Whether lost messages are sent again."""
    latched: bool | None = None
    """Whether those who come later get the last message."""
    depth: Annotated[int | None, Bounds(1, 1000)] = None
    """Number of messages that wait."""

    def __post_init__(self) -> None:
        _check_name("name", self.name)


@dataclass(frozen=True)
class Ros2:
    """Node in ROS 2's graph, `lariat up --ros2`, and bags that are exported."""

    namespace: str = "/lariat"
    """Namespace of the node and of its topics that are not common to all robots."""
    world_frame: str = "world"
    """Name of the world's frame."""
    frame_prefix: str = ""
    """Prefix of all other frames, as robot_state_publisher has it; in RViz, the TF Prefix."""
    topics: dict[str, Ros2Topic] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        _check_name("namespace", self.namespace)
        if self.namespace and not self.namespace.startswith("/"):
            raise ValueError(f"namespace = {self.namespace!r}; write '/{self.namespace}'")
        _check_name("world_frame", self.world_frame)
        _check_name("frame_prefix", self.frame_prefix.removesuffix("/"))


def _check_name(key: str, value: str) -> None:
    """Check a name of the graph, which is part of the wire's keys.

    Raises:
        ValueError: It is none.
    """
    if value and not _NAME.fullmatch(value):
        raise ValueError(f"{key} = {value!r} is no ROS 2 name; use {_NAME_RULE}")
