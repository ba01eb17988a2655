"""Poses, obstacles, grippers, polylines and cameras, in plain NumPy."""

from __future__ import annotations

from lariat.geometry import polylines, poses
from lariat.geometry.cameras import Camera, Intrinsics, looking_at
from lariat.geometry.grippers import (
    GripperBody,
    axis_clearance,
    axis_spacing,
    gripper_axis_distance,
    gripper_bodies,
    gripper_points,
    swept_gripper_points,
)
from lariat.geometry.near_pairs import NearPairs, near_pairs
from lariat.geometry.obstacles import (
    TABLE,
    Obstacle,
    chain_clearance,
    outward_normals,
    pack,
    scene_distance,
    segment_distance,
    signed_distance,
)
from lariat.geometry.polylines import with_midpoints
from lariat.geometry.poses import Pose

__all__ = [
    "TABLE",
    "Camera",
    "GripperBody",
    "Intrinsics",
    "NearPairs",
    "Obstacle",
    "Pose",
    "axis_clearance",
    "axis_spacing",
    "chain_clearance",
    "gripper_axis_distance",
    "gripper_bodies",
    "gripper_points",
    "looking_at",
    "near_pairs",
    "outward_normals",
    "pack",
    "polylines",
    "poses",
    "scene_distance",
    "segment_distance",
    "signed_distance",
    "swept_gripper_points",
    "with_midpoints",
]
