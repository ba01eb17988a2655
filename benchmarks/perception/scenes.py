"""Random views of a hanging rope, for `lariat bench perception`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.geometry.cameras import Camera, Intrinsics, looking_at
from lariat.geometry.grippers import gripper_capsules
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.perception.centerline.estimate import RopeDimensions
from lariat.rod import RodProperties
from lariat.scenario.goal_table import LEVEL_GRIP
from lariat.simulation.plants.flex_rope import FlexRope
from lariat.simulation.plants.mujoco_plant import MujocoPlant
from lariat.simulation.plants.mujoco_rope import MujocoRope

Kind = Literal["easy", "hidden", "hard"]

PLANT_EDGES = 3
"""Edges of the true rope for each edge of the rope that is looked for [-]."""
ROPES = {
    "rope": MujocoRope(0.45, 0.008, 30, 0.044, 1.0e6, damping=2.0),
    "cable": MujocoRope(0.55, 0.005, 40, 0.040, 6.0e7, damping=2.0),
}
"""The paper's rope and cable, with estimated stiffness."""
STIFFNESS_ERROR = 2.0
"""Stiffness that perception believes, relative to the true one [-]."""
FIELD_OF_VIEW = math.radians(65.0)
"""Horizontal field of view [rad]."""
BALL_POSITION = 0.65
"""Position of the ball that hides a part of the rope, between camera (0) and rope (1) [-]."""
GRIPPER_SIZE = (0.048, 0.012)
"""Reach and radius of a gripper [m]."""
MAX_LENGTH_ERROR, MAX_GRIP_ERROR = 0.003, 0.001
"""Errors of length and grip points of a simulated rest shape above which it is discarded [m]."""


class View(NamedTuple):
    """Rope at rest, and a camera that sees it."""

    camera: Camera
    left: Pose
    """Left grip."""
    right: Pose
    """Right grip."""
    nodes: Float64[np.ndarray, "n 3"]
    """True nodes of the rope, as many as are to be found [m]."""
    rope: Float64[np.ndarray, "m 3"]
    """All nodes of the true rope, which is finer [m]."""
    bodies: list[Obstacle]
    """Everything else in view."""


def believed(truth: MujocoRope) -> tuple[RodProperties, RopeDimensions]:
    """Return what perception believes of a rope."""
    rod = RodProperties(
        truth.length, truth.diameter, truth.linear_density, STIFFNESS_ERROR * truth.youngs_modulus
    )
    weight_over_stiffness = 9.81 * truth.linear_density / rod.bending_stiffness
    return rod, RopeDimensions(
        truth.length, truth.diameter / 2.0, truth.node_count, weight_over_stiffness
    )


def views_of(
    truth: MujocoRope, kind: Kind, resolution: tuple[int, int], count: int, seed: int
) -> Iterator[View]:
    """Yield random views of a rope that MuJoCo has brought to rest.

    Args:
        truth: Rope to look at.
        kind: Kind of views.
        resolution: Width and height of the images [pixels].
        count: Number of views.
        seed: Seed of grips and cameras.
    """
    random = np.random.default_rng(seed)
    fine = replace(truth, node_count=PLANT_EDGES * (truth.node_count - 1) + 1)
    plant = MujocoPlant(FlexRope(fine))
    intrinsics = Intrinsics.symmetric(*resolution, FIELD_OF_VIEW)
    made = 0
    while made < count:
        left, right = _sample_grips(random, truth.length, kind)
        plant.reset(left, right)
        nodes = plant.nodes
        ends = np.array([left.position, right.position])
        grip_error = float(np.max(np.linalg.norm(nodes[[0, -1]] - ends, axis=1)))
        length_error = abs(polylines.length(nodes) - truth.length)
        if length_error > MAX_LENGTH_ERROR or grip_error > MAX_GRIP_ERROR:
            # MuJoCo's rope has collapsed or left its clamps: not a rest shape of a rope.
            continue
        made += 1
        bodies = [
            Obstacle("half_space", (0.0, 0.0, -0.2)),
            *gripper_capsules(left, right, *GRIPPER_SIZE),
        ]
        middle = nodes.mean(axis=0)
        azimuth, elevation = random.uniform(-math.pi, math.pi), random.uniform(0.6, 1.5)
        toward = np.array([math.cos(azimuth), math.sin(azimuth), math.tan(elevation)])
        eye = middle + 0.75 * poses.normalized(toward)
        if kind != "hard":
            eye, middle = np.array([0.0, -0.05, 1.0]), np.array([0.0, 0.0, 0.2])
        camera = Camera(intrinsics, looking_at(tuple(eye), tuple(middle)))
        if kind == "hidden":
            bodies.append(_ball(random, camera, nodes))
        yield View(camera, left, right, nodes[::PLANT_EDGES], nodes, bodies)


def _sample_grips(random: np.random.Generator, length: float, kind: Kind) -> tuple[Pose, Pose]:
    hard = kind == "hard"
    gap = random.uniform(0.1, 0.7) if hard else random.uniform(0.45, 0.93)
    yaw = random.uniform(-math.pi, math.pi) if hard else random.uniform(-0.8, 0.8)
    slope = random.uniform(-0.5, 0.5) if hard else random.uniform(-0.3, 0.3)
    half = gap * length / 2.0 * np.array([math.cos(yaw), math.sin(yaw), slope])
    place = np.array([*random.uniform(-0.05, 0.05, 2), random.uniform(0.22, 0.35)])
    turns = []
    for _ in range(2):
        extra = random.choice([0.0, 0.0, 1.5, -1.5, 3.0]) if hard else 0.0
        tilt = poses.exponential(random.normal(0.0, 0.9 if hard else 0.35, 3))
        about_z = poses.exponential(np.array([0.0, 0.0, yaw + extra]))
        turns.append(poses.multiply(tilt, poses.multiply(about_z, LEVEL_GRIP)))
    return Pose(place - half, turns[0]), Pose(place + half, turns[1])


def _ball(
    random: np.random.Generator, camera: Camera, nodes: Float64[np.ndarray, "n 3"]
) -> Obstacle:
    """Return a ball between the camera and a third of the rope."""
    n = len(nodes)
    count = n // 3
    first = int(random.integers(n // 8, n - n // 8 - count))
    middle = nodes[first + count // 2]
    eye = camera.T_world_camera.position
    to_ball = BALL_POSITION * (middle - eye)
    to_nodes = poses.normalized(nodes - eye)
    # A ball hides a node if the distance of its centre from the node's ray is below its radius.
    ray_distance = np.linalg.norm(np.cross(to_nodes, to_ball), axis=1)
    return Obstacle("sphere", tuple(eye + to_ball), radius=float(np.sort(ray_distance)[count - 1]))
