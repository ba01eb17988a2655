"""Markers of ROS 2 from the entities of a `foxglove.SceneUpdate`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from shared.messages import from_timestamp
from shared.ros2.types import header, ros, vector

CUBE, SPHERE, CYLINDER, LINE_STRIP, TRIANGLE_LIST = 1, 2, 3, 4, 11
"""Types of visualization_msgs/Marker."""
DELETE = 2
"""Action of visualization_msgs/Marker; that of a marker which is shown is 0."""


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
            markers += [_marker(entity, k, **shape) for k, shape in enumerate(shapes)]
            gone = range(len(shapes), self._counts.get(entity.id, 0))
            markers += [_marker(entity, k, action=DELETE) for k in gone]
            self._counts[entity.id] = len(shapes)
        return ros("visualization_msgs/msg/MarkerArray", markers=markers)


def _shapes(entity: SceneEntity) -> Iterator[dict[str, Any]]:
    """Fields of the markers of an entity; its poses, points and colors have those of ROS 2's."""
    for line in entity.lines:
        scale = vector((line.thickness, 0.0, 0.0))
        yield _fields(LINE_STRIP, line, scale, points=line.points, colors=line.colors)
    bodies = (CUBE, entity.cubes), (SPHERE, entity.spheres), (CYLINDER, entity.cylinders)
    for kind, primitives in bodies:
        for body in primitives:
            yield _fields(kind, body, body.size)
    for mesh in entity.triangles:
        corners = [mesh.points[k] for k in mesh.indices]
        yield _fields(TRIANGLE_LIST, mesh, vector((1.0, 1.0, 1.0)), points=corners)


def _fields(kind: int, shape: Any, scale: Any, **fields: Any) -> dict[str, Any]:
    return {"type": kind, "pose": shape.pose, "color": shape.color, "scale": scale, **fields}


def _marker(entity: SceneEntity, number: int, **fields: Any) -> Any:
    return ros(
        "visualization_msgs/msg/Marker",
        header=header(from_timestamp(entity.timestamp), entity.frame_id),
        ns=entity.id,
        id=number,
        frame_locked=entity.frame_locked,
        **fields,
    )
