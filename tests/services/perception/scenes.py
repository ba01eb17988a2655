"""Rope shapes, and simulated frames of them."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.geometry.cameras import Camera, Intrinsics, looking_at
from lariat.geometry.obstacles import TABLE, Obstacle
from lariat.geometry.poses import Pose
from lariat.perception.centerline.estimate import RopeDimensions
from lariat.simulation.camera.rgbd_camera import Frame, RgbdCamera
from lariat.simulation.camera.sensor_noise import SensorNoise

CAMERA = Camera(
    Intrinsics.symmetric(640, 480, math.radians(65.0)),
    looking_at((0.0, -0.05, 1.0), (0.0, 0.0, 0.2)),
)
ROPE = RopeDimensions(length=0.45, radius=0.004, node_count=30)


def curve(seed: int, rope: RopeDimensions = ROPE, bend: float = 1.0) -> Float64[np.ndarray, "n 3"]:
    """Nodes of a smooth curve with the rope's length, from three random harmonics of its angles."""
    random = np.random.default_rng(seed)
    s = np.linspace(0.0, 1.0, 2000)
    yaw, pitch = np.zeros_like(s), np.zeros_like(s)
    for k in (1, 2, 3):
        yaw += bend * random.normal(0.0, 0.5 / k) * np.cos(math.pi * k * s)
        pitch += bend * random.normal(0.0, 0.4 / k) * np.cos(math.pi * k * s)
    steps = np.stack(
        [np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)], axis=1
    )
    path = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    nodes = polylines.resample(path, rope.node_count)
    nodes *= rope.length / polylines.length(nodes)
    return nodes - nodes.mean(axis=0) + np.array([0.0, 0.0, 0.25])


def grips(nodes: Float64[np.ndarray, "n 3"]) -> tuple[Pose, Pose]:
    """Grips that hold the first and last edges of a chain."""
    z = np.array([0.0, 0.0, 1.0])
    first, last = poses.normalized(nodes[1] - nodes[0]), poses.normalized(nodes[-1] - nodes[-2])
    return (
        Pose(nodes[0], poses.rotation_between(z, first)),
        Pose(nodes[-1], poses.rotation_between(z, last)),
    )


def taken(
    nodes: Float64[np.ndarray, "n 3"],
    bodies: tuple[Obstacle, ...] = (),
    camera: Camera = CAMERA,
    rope: RopeDimensions = ROPE,
    noise: SensorNoise | None = None,
    frame: int = 0,
) -> Frame:
    """Frame of a chain over the table."""
    return RgbdCamera(camera, noise, seed=1).take(nodes, rope.radius, (TABLE, *bodies), frame=frame)


def screen(nodes: Float64[np.ndarray, "n 3"], first: int, last: int) -> Obstacle:
    """Sphere between chain and camera that hides the nodes from `first` to `last`."""
    eye = CAMERA.T_world_camera.position
    (a, b), _ = CAMERA.project(nodes[[first, last]])
    middle = nodes[(first + last) // 2]
    place = eye + 0.6 * (middle - eye)
    radius = 0.5 * float(np.linalg.norm(b - a)) / CAMERA.intrinsics.fx * 0.6
    return Obstacle("sphere", tuple(place), radius=radius * float(np.linalg.norm(middle - eye)))
