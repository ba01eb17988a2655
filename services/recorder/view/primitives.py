"""Primitives of a `foxglove.SceneUpdate`: lines, and bodies of obstacles, arms and grippers."""

from __future__ import annotations

import numpy as np
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.CylinderPrimitive_pb2 import CylinderPrimitive
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.Pose_pb2 import Pose as PoseMessage
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from jaxtyping import Float64, Int64

from lariat.arms.urdf import Body
from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from services.recorder.view import colors
from services.recorder.view.curves import Curves
from services.recorder.view.mesh_hulls import MeshHull
from shared.frames import quaternion_message, vector_message

HALF_SPACE_SIDE = 2.0
"""Side of the square drawn for a half space [m]."""
HALF_SPACE_THICKNESS = 1e-3
"""Thickness of that square [m]."""


def add_curves(entity: SceneEntity, curves: Curves, thickness: float) -> None:
    """Add polylines of a thickness [m] to an entity."""
    for points, shades in curves.lines:
        same = bool(np.all(shades == shades[0]))
        entity.lines.add(
            type=LinePrimitive.LINE_STRIP,
            pose=pose_message(Pose(np.zeros(3), poses.IDENTITY)),
            thickness=thickness,
            points=[Point3(x=x, y=y, z=z) for x, y, z in points.tolist()],
            color=colors.message(shades[0]),
            colors=[] if same else [colors.message(shade) for shade in shades],
        )


def add_obstacle(entity: SceneEntity, obstacle: Obstacle) -> None:
    """Add an obstacle, or a region to keep in, to an entity of the world's frame."""
    pose = Pose(np.array(obstacle.position), np.array(obstacle.orientation))
    color = colors.SUPPORT if obstacle.support else colors.OBSTACLE
    color = colors.REGION if obstacle.keep_in else color
    radius, height = obstacle.radius, obstacle.height
    match obstacle.shape:
        case "box":
            add_body(entity, pose, "box", obstacle.size, color)
        case "sphere":
            add_body(entity, pose, "sphere", (radius,), color)
        case "cylinder":
            add_body(entity, pose, "cylinder", (radius, height), color)
        case "capsule":
            add_body(entity, pose, "cylinder", (radius, height), color)
            for end in (-0.5, 0.5):
                cap = pose.apply(np.array([0.0, 0.0, end * height]))
                add_body(entity, Pose(cap, pose.orientation), "sphere", (radius,), color)
        case "half_space":
            plane = half_space_pose(obstacle)
            center = plane.apply(np.array([0.0, 0.0, -HALF_SPACE_THICKNESS / 2.0]))
            size = (HALF_SPACE_SIDE, HALF_SPACE_SIDE, HALF_SPACE_THICKNESS)
            add_body(entity, Pose(center, plane.orientation), "box", size, color)
        case _:
            # Foxglove has no primitive of its own.
            mesh = obstacle.row.mesh(obstacle.packed_sizes)
            add_triangles(entity, pose, mesh.points, mesh.triangles, color)


def half_space_pose(obstacle: Obstacle) -> Pose:
    """Return the pose of a frame on the surface of a half space whose z axis points out of it."""
    normal = poses.normalized(np.array(obstacle.normal))
    turn = poses.rotation_between(np.array([0.0, 0.0, 1.0]), normal)
    return Pose(np.array(obstacle.position), poses.multiply(np.array(obstacle.orientation), turn))


def add_link_body(entity: SceneEntity, body: Body, color: tuple[float, ...]) -> None:
    """Add a body to an entity of its link's frame."""
    add_body(entity, body.T_link_body, body.shape, body.size, color)


def add_hull(entity: SceneEntity, hull: MeshHull, color: tuple[float, ...]) -> None:
    """Add the hull of a mesh to an entity of its link's frame."""
    link = Pose(np.zeros(3), poses.IDENTITY)
    add_triangles(entity, link, hull.points, hull.triangles, color)


def add_triangles(
    entity: SceneEntity,
    pose: Pose,
    points: Float64[np.ndarray, "p 3"],
    triangles: Int64[np.ndarray, "t 3"],
    color: tuple[float, ...],
) -> None:
    """Add triangles to an entity, by the indices of their corners [m]."""
    entity.triangles.add(
        pose=pose_message(pose),
        points=[Point3(x=x, y=y, z=z) for x, y, z in points.tolist()],
        indices=triangles.ravel().tolist(),
        color=colors.message(color),
    )


def add_body(
    entity: SceneEntity,
    pose: Pose,
    shape: str,
    size: tuple[float, ...],
    color: tuple[float, ...],
) -> None:
    """Add a body: a box of edge lengths, a cylinder about z of radius and length, or a sphere."""
    place, shade = pose_message(pose), colors.message(color)
    match shape:
        case "box":
            x, y, z = size
            edges = Vector3(x=x, y=y, z=z)
            entity.cubes.append(CubePrimitive(pose=place, size=edges, color=shade))
        case "sphere":
            (radius,) = size
            extents = Vector3(x=2.0 * radius, y=2.0 * radius, z=2.0 * radius)
            entity.spheres.append(SpherePrimitive(pose=place, size=extents, color=shade))
        case "cylinder":
            radius, length = size
            extents = Vector3(x=2.0 * radius, y=2.0 * radius, z=length)
            entity.cylinders.append(
                CylinderPrimitive(
                    pose=place, size=extents, bottom_scale=1.0, top_scale=1.0, color=shade
                )
            )


def pose_message(pose: Pose) -> PoseMessage:
    """Return the message of a pose."""
    return PoseMessage(
        position=vector_message(pose.position), orientation=quaternion_message(pose.orientation)
    )
