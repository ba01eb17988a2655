"""Markers of ROS 2 from a drawing, as a receiver decodes them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from lariat.geometry.obstacles import Obstacle
from services.recorder.view.primitives import add_obstacle
from shared.ros2.markers import DELETE, LINE_STRIP, TRIANGLE_LIST, Markers
from shared.ros2.types import decoded, encoded

KIND = "visualization_msgs/msg/MarkerArray"


def drawn(update: SceneUpdate, markers: Markers | None = None) -> Any:
    payload = bytes(encoded((markers or Markers()).converted(update)))
    got = decoded(payload, KIND)
    # Field by field, as of objects.
    assert encoded(got) == payload
    return got.markers


@pytest.mark.parametrize("count", range(5))
@pytest.mark.parametrize("name", ["a", "ab", "abc", "abcd", "abcdefgh"])
def test_points_and_colours_follow_names_of_any_length(name: str, count: int):
    update = SceneUpdate()
    for _ in range(3):
        entity = update.entities.add(id=name, frame_id="world")
        entity.spheres.add()
        line = entity.lines.add(thickness=0.5)
        line.points.extend(Point3(x=k, y=2.0, z=-3.0) for k in range(count))
        line.colors.extend(Color(r=0.5, g=0.25, b=1.0, a=k) for k in range(count))
    lines = [marker for marker in drawn(update) if marker.type == LINE_STRIP]
    assert [marker.ns for marker in lines] == [name] * 3
    for line in lines:
        assert [(p.x, p.y, p.z) for p in line.points] == [(k, 2.0, -3.0) for k in range(count)]
        colors = [(c.r, c.g, c.b, c.a) for c in line.colors]
        assert colors == [(0.5, 0.25, 1.0, k) for k in range(count)]
        assert (line.scale.x, line.header.frame_id, line.text) == (0.5, "world", "")


def test_bodies_that_an_entity_no_longer_has_are_deleted():
    markers, full, empty = Markers(), SceneUpdate(), SceneUpdate()
    full.entities.add(id="obstacles").spheres.add()
    empty.entities.add(id="obstacles")
    assert [m.action for m in drawn(full, markers)] == [0]
    assert [(m.action, m.id) for m in drawn(empty, markers)] == [(DELETE, 0)]
    assert drawn(empty, markers) == []


def test_bodies_of_triangles_are_markers_of_triangles():
    update = SceneUpdate()
    cone = Obstacle("cone", (0.1, 0.0, 0.2), radius=0.05, height=0.1)
    add_obstacle(update.entities.add(id="obstacles"), cone)
    (marker,) = drawn(update)
    corners = np.array([[p.x, p.y, p.z] for p in marker.points]).reshape(-1, 3, 3)
    assert marker.type == TRIANGLE_LIST
    assert (corners[..., 2].min(), corners[..., 2].max()) == (-0.05, 0.05)
    assert len(corners) == len(cone.row.mesh(cone.packed_sizes).triangles)
