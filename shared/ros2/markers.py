"""Markers of ROS 2 from the entities of a `foxglove.SceneUpdate`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from shared.messages import from_timestamp
from shared.ros2.types import header, ros, vector

CUBE, SPHERE, CYLINDER, LINE_STRIP, TRIANGLE_LIST = 1, 2, 3, 4, 11
"""Types of visualization_msgs/Marker."""
ADD, DELETE = 0, 2
"""Actions of visualization_msgs/Marker."""


@dataclass
class Markers:
    """Converter that deletes the markers which an entity no longer has.

    An entity becomes a namespace, its primitives are numbered.
    """

    _counts: dict[str, int] = field(default_factory=dict)

    def converted(self, update: SceneUpdate) -> Any:
        """Return the visualization_msgs/MarkerArray of an update."""
        markers = []
        for entity in update.entities:
            shapes = list(_shapes(entity))
            markers += [_marker(entity, k, shape) for k, shape in enumerate(shapes)]
            markers += [
                _marker(entity, k, None) for k in range(len(shapes), self._counts.get(entity.id, 0))
            ]
            self._counts[entity.id] = len(shapes)
        return ros("visualization_msgs/msg/MarkerArray", markers=markers)


@dataclass(frozen=True)
class _Shape:
    """Shape whose pose, points and colors have the fields of ROS 2's."""

    type: int
    pose: Pose
    scale: Any
    color: Color
    points: Sequence[Any] = ()
    colors: Sequence[Color] = ()


def _shapes(entity: SceneEntity) -> Iterator[_Shape]:
    for line in entity.lines:
        scale = vector((line.thickness, 0.0, 0.0))
        yield _Shape(LINE_STRIP, line.pose, scale, line.color, line.points, line.colors)
    bodies = (CUBE, entity.cubes), (SPHERE, entity.spheres), (CYLINDER, entity.cylinders)
    for kind, primitives in bodies:
        for body in primitives:
            yield _Shape(kind, body.pose, body.size, body.color)
    for mesh in entity.triangles:
        corners = [mesh.points[k] for k in mesh.indices]
        yield _Shape(TRIANGLE_LIST, mesh.pose, vector((1.0, 1.0, 1.0)), mesh.color, corners)


def _marker(entity: SceneEntity, number: int, shape: _Shape | None) -> Any:
    """Marker of a shape, or the deletion of the one with its number."""
    drawn = shape or _Shape(CUBE, Pose(), vector((0.0, 0.0, 0.0)), Color())
    return ros(
        "visualization_msgs/msg/Marker",
        header=header(from_timestamp(entity.timestamp), entity.frame_id),
        ns=entity.id,
        id=number,
        type=drawn.type,
        action=ADD if shape else DELETE,
        pose=drawn.pose,
        scale=drawn.scale,
        color=drawn.color,
        frame_locked=entity.frame_locked,
        points=drawn.points,
        colors=drawn.colors,
    )
