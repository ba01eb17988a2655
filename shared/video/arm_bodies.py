"""Bodies of a cell's arms at given joint angles, from the collision bodies of their URDFs."""

from __future__ import annotations

import logging
from importlib.util import find_spec

import numpy as np

from lariat.arms.description import ArmDescription, arm_description
from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.scenario import Scenario, Side
from lariat.scenario.placement import base_of

log = logging.getLogger(__name__)


class ArmBodies:
    """Bodies of one arm, each a primitive; a mesh is stood for by spheres that cover it."""

    def __init__(self, description: ArmDescription, T_world_base: Pose) -> None:
        # Imported late: images of single processes have no Pinocchio.
        from lariat.arms.kinematics import load_arm

        self._model, self._geometry = load_arm(description.urdf, description.flange)
        self._state, self._placements = self._model.createData(), self._geometry.createData()
        self._T_world_base = T_world_base
        self._shapes = [_primitives(body) for body in self._geometry.geometryObjects]

    def at(self, joints: np.ndarray) -> tuple[Obstacle, ...]:
        """Return the bodies in the world, by joint angles from the base; none unless all are."""
        import pinocchio  # pyright: ignore[reportMissingImports]

        if len(joints) != self._model.nq:
            return ()
        pinocchio.updateGeometryPlacements(
            self._model, self._state, self._geometry, self._placements, joints
        )
        bodies = []
        for shapes, placement in zip(self._shapes, self._placements.oMg, strict=True):
            orientation = poses.from_matrix(np.array(placement.rotation))
            pose = self._T_world_base @ Pose(np.array(placement.translation), orientation)
            bodies += [_moved(shape, pose) for shape in shapes]
        return tuple(bodies)


def arm_bodies(scenario: Scenario, side: Side) -> ArmBodies | None:
    """Return the bodies of an end's arm; None where there is none, or it cannot be read here."""
    description = arm_description(scenario, side)
    if description is None or find_spec("pinocchio") is None:
        return None
    try:
        return ArmBodies(description, base_of(scenario.end(side)))
    except ValueError as error:
        # A recording's scenario may name a file of another machine.
        log.warning("the %s arm is not drawn: %s", side, error)
        return None


def _primitives(body) -> list[Obstacle]:
    """Primitives of a collision body, in its own frame."""
    shape, origin = body.geometry, (0.0, 0.0, 0.0)
    match type(shape).__name__:
        case "Cylinder":
            height = 2.0 * shape.halfLength
            return [Obstacle("cylinder", origin, radius=shape.radius, height=height)]
        case "Capsule":
            height = 2.0 * shape.halfLength
            return [Obstacle("capsule", origin, radius=shape.radius, height=height)]
        case "Sphere":
            return [Obstacle("sphere", origin, radius=shape.radius)]
        case "Box":
            x, y, z = (2.0 * half for half in shape.halfSide)
            return [Obstacle("box", origin, size=(x, y, z))]
    from lariat.arms.sphere_cover import sphere_cover

    rotation, translation = np.array(body.placement.rotation), np.array(body.placement.translation)
    centres, radii = sphere_cover(body)  # In the frame of the joint.
    return [
        Obstacle("sphere", (x, y, z), radius=r)
        for (x, y, z), r in zip(
            ((centres - translation) @ rotation).tolist(), radii.tolist(), strict=True
        )
    ]


def _moved(shape: Obstacle, pose: Pose) -> Obstacle:
    x, y, z = pose.apply(np.array(shape.position)).tolist()
    w, i, j, k = pose.orientation.tolist()
    return shape.moved((x, y, z), (w, i, j, k))
