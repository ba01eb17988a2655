"""Frames of a sequence: MuJoCo's rope between moving grips, seen by the simulated camera."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64

from benchmarks.perception.following.cases import DURATION, ROPE_COLOR, Case, sequence
from benchmarks.perception.scenes import FIELD_OF_VIEW, GRIPPER_SIZE, PLANT_EDGES
from lariat.geometry.cameras import Camera, Intrinsics, looking_at
from lariat.geometry.grippers import gripper_capsules
from lariat.geometry.obstacles import TABLE
from lariat.geometry.poses import Pose
from lariat.simulation.camera.depth_faults import DepthFaults
from lariat.simulation.camera.rgbd_camera import Frame, RgbdCamera, Tube
from lariat.simulation.plants.end_motion import EndMotion
from lariat.simulation.plants.flex_rope import FlexRope
from lariat.simulation.plants.mujoco_plant import MujocoPlant
from lariat.simulation.plants.mujoco_rope import MujocoRope

FRAME_RATE = 30.0
"""Frame rate [Hz]."""
VIEW = Camera(
    Intrinsics.symmetric(640, 480, FIELD_OF_VIEW),
    looking_at((0.0, -0.05, 1.0), (0.0, 0.0, 0.15)),
)
"""The camera of a cell."""
HIDING_DEPTH = 0.012
"""Depth in front of the rope's surface below which a measured depth is of something else [m]."""


@dataclass(frozen=True)
class TrueFrame:
    """Images, and what they show."""

    time: float
    """Time of the exposure since the start [s]."""
    images: Frame
    left: Pose
    """Left grip."""
    right: Pose
    """Right grip."""
    nodes: Float64[np.ndarray, "n 3"]
    """True nodes of the held rope, as many as are to be found [m]."""
    visible: Bool[np.ndarray, "n"]
    """Whether each of them is in view with nothing in front of it."""
    tubes: list[Tube]
    """Other ropes and hands."""


def frames_of(
    truth: MujocoRope, case: Case, seed: int, faults: DepthFaults | None = None
) -> Iterator[TrueFrame]:
    """Yield the frames of a random sequence.

    Args:
        truth: The held rope, with as many nodes as are to be found.
        case: Kind of the sequence.
        seed: Its seed.
        faults: Further errors of the depth images; none by default.
    """
    moving = sequence(case, truth.length, truth.diameter / 2.0, seed)
    plant = MujocoPlant(
        FlexRope(replace(truth, node_count=PLANT_EDGES * (truth.node_count - 1) + 1))
    )
    plant.reset(*moving.grips(0.0))
    camera = RgbdCamera(VIEW, seed=seed, rope_color=ROPE_COLOR, faults=faults)
    step = 1.0 / FRAME_RATE
    for number in range(round(DURATION * FRAME_RATE)):
        time = number * step
        left, right = moving.grips(time)
        if number:
            motion = [
                EndMotion(now, (then.position - now.position) / 1e-4)
                for now, then in zip((left, right), moving.grips(time + 1e-4), strict=True)
            ]
            plant.step(motion[0], motion[1], step)
        bodies = [TABLE, *gripper_capsules(left, right, *GRIPPER_SIZE)]
        tubes = moving.tubes(time)
        images = camera.take(plant.nodes, truth.diameter / 2.0, bodies, frame=number, tubes=tubes)
        nodes = plant.nodes[::PLANT_EDGES].copy()
        visible = _visible(nodes, truth.diameter / 2.0, images)
        yield TrueFrame(time, images, left, right, nodes, visible, tubes)


def _visible(
    nodes: Float64[np.ndarray, "n 3"], radius: float, images: Frame
) -> Bool[np.ndarray, "n"]:
    """Whether the surface of the rope at each node is the first on its ray."""
    pixels, z = VIEW.project(nodes)
    at = np.rint(pixels).astype(int)
    height, width = images.depth.shape
    inside = (at >= 0).all(axis=1) & (at[:, 0] < width) & (at[:, 1] < height)
    column, row = np.clip(at, 0, [width - 1, height - 1]).T
    depth = images.depth[row, column] / 1000.0
    in_front = (depth > 0.0) & (depth < z - radius - HIDING_DEPTH)
    return inside & ~in_front
