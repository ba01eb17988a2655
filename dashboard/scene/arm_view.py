"""Arm of one end in the scene: the collision bodies of its URDF, at the reported joint angles.

Pinocchio reads the URDF; where it is not installed, as in the dashboard's image, no arm is drawn.
"""

from __future__ import annotations

import logging
from importlib.util import find_spec

import numpy as np
import viser

from dashboard import palette
from dashboard.scene import meshes
from dashboard.scene.meshes import Mesh
from lariat.arms.description import ArmDescription, arm_description
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.scenario import Scenario, Side
from lariat.scenario.placement import base_of

log = logging.getLogger(__name__)

OPACITY = 0.55
"""Opacity of the bodies [-]: they are simpler than the arm, and what is behind them shows."""


class ArmView:
    """Bodies of one arm; hidden until its joints are known."""

    def __init__(
        self, scene: viser.SceneApi, description: ArmDescription, base: Pose, side: Side
    ) -> None:
        # Imported late: the dashboard runs without Pinocchio.
        from lariat.arms.kinematics import load_arm

        self._model, self._geometry = load_arm(description.urdf, description.flange)
        self._state, self._placements = self._model.createData(), self._geometry.createData()
        self._base = base
        self._bodies = [
            scene.add_mesh_simple(
                f"/arms/{side}/body{k}",
                *_mesh(body),
                color=palette.QUIET,
                opacity=OPACITY,
                visible=False,
            )
            for k, body in enumerate(self._geometry.geometryObjects)
        ]

    def update(self, joints: np.ndarray) -> None:
        """Move the bodies by joint angles from the base on; others than it has are ignored."""
        # Imported late, as above.
        import pinocchio  # pyright: ignore[reportMissingImports]

        if len(joints) != self._model.nq:
            return
        pinocchio.updateGeometryPlacements(
            self._model, self._state, self._geometry, self._placements, joints
        )
        for body, placement in zip(self._bodies, self._placements.oMg, strict=True):
            orientation = poses.from_matrix(np.array(placement.rotation))
            pose = self._base @ Pose(np.array(placement.translation), orientation)
            body.position, body.wxyz, body.visible = pose.position, pose.orientation, True


def arm_view(scene: viser.SceneApi, scenario: Scenario, side: Side) -> ArmView | None:
    """Add the arm of an end; None where there is none, or its URDF cannot be read here."""
    description = arm_description(scenario, side)
    if description is None or find_spec("pinocchio") is None:
        return None
    try:
        return ArmView(scene, description, base_of(scenario.end(side)), side)
    except ValueError as error:
        # A recording's scenario may name a file of another machine.
        log.warning("the %s arm is not drawn: %s", side, error)
        return None


def _mesh(body) -> Mesh:
    """Triangles of a collision body, in its own frame."""
    shape = body.geometry
    match type(shape).__name__:
        case "Cylinder":
            return meshes.of_shape("cylinder", shape.radius, shape.halfLength)
        case "Capsule":
            return meshes.of_shape("capsule", shape.radius, shape.halfLength)
        case "Sphere":
            return meshes.of_shape("sphere", shape.radius)
        case "Box":
            return meshes.of_shape("box", *shape.halfSide)
    vertices = np.array([shape.vertex(k) for k in range(shape.num_vertices)])
    faces = np.array([[shape.tri_indices(k)[i] for i in range(3)] for k in range(shape.num_tris)])
    return Mesh(vertices * np.array(body.meshScale), faces)
