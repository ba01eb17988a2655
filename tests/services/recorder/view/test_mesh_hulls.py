"""Hulls that are drawn for the meshes of an arm's links."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from lariat.arms.kinematics import load_arm
from lariat.scenario import find, load
from lariat.scenario.settings import load_with
from services.recorder.view.cell_view import CellView
from services.recorder.view.mesh_hulls import GRID, mesh_hulls
from tests.robots import PANDA, UR5, Robot


@pytest.mark.parametrize("robot", [UR5, PANDA], ids=lambda robot: robot.name)
def test_every_mesh_lies_within_the_hull_of_its_link(robot: Robot):
    hulls = {
        h.link: h
        for h in mesh_hulls(load_with(find("fixed-end"), robot.settings("right")), "right")
    }
    model, geometry = load_arm(robot.path, robot.flange)
    meshes = [b for b in geometry.geometryObjects if hasattr(b.geometry, "tri_indices")]
    assert len(meshes) >= 7
    for body in meshes:
        frame = model.frames[body.parentFrame]
        hull = hulls[frame.name]
        place = frame.placement.inverse() * body.placement
        count = body.geometry.num_vertices
        corners = np.array([body.geometry.vertex(k) for k in range(count)]) * body.meshScale
        corners = corners @ place.rotation.T + place.translation
        planes = ConvexHull(hull.points).equations
        outside = np.max(corners @ planes[:, :3].T + planes[:, 3])
        assert outside < GRID


def test_an_arm_of_primitives_has_no_hulls_and_is_drawn_all_the_same():
    scenario = load(find("two-arms"))
    assert mesh_hulls(scenario, "left") == ()
    said = {topic.key: message for topic, message in CellView(scenario).draw(10**18)}
    drawn = {entity.id for entity in said["view/scene"].entities}
    assert {"left/link_3", "right/link_3"} <= drawn


def test_an_arm_of_meshes_is_drawn_by_their_hulls():
    view = CellView(load_with(find("fixed-end"), UR5.settings("right")))
    said = {topic.key: message for topic, message in view.draw(10**18)}
    drawn = {e.id: e for e in said["view/scene"].entities}
    assert drawn["right/forearm_link/hull"].frame_id == "right/forearm_link"
    assert len(drawn["right/forearm_link/hull"].triangles[0].indices) > 100
