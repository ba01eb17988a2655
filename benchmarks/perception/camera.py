"""Cost of the simulated camera and accuracy of markers in its images: `lariat bench perception
camera`.

The images show a sagging curve of 40 nodes in place of a rope, three cylinders, two grippers
and the table. The cost is the processor time of one frame with all noise, without messages. Markers
are perceived in the simulated images, one at a time on a box.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

from benchmarks.perception.scenes import FIELD_OF_VIEW, GRIPPER_SIZE
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from lariat.geometry import poses
from lariat.geometry.cameras import Camera, Intrinsics, looking_at
from lariat.geometry.grippers import gripper_capsules
from lariat.geometry.obstacles import TABLE, Obstacle
from lariat.geometry.poses import Pose
from lariat.perception.markers.marker_detection import MarkerDetector
from lariat.perception.markers.marker_pose import MarkerPoseFilter, locate_marker
from lariat.scenario.goal_table import LEVEL_GRIP
from lariat.simulation.camera.marker_plates import MarkerPlate
from lariat.simulation.camera.rgbd_camera import RgbdCamera

RESOLUTIONS = ((640, 480), (1280, 720))
"""Widths and heights of the images [pixels]."""
CAMERA_POSITION, CAMERA_TARGET = (0.0, -0.05, 1.0), (0.0, 0.0, 0.1)
"""Position of the camera, and a point on its optical axis [m]."""
NODE_COUNT, ROPE_RADIUS = 40, 0.004
"""Nodes and radius [m] of the rope."""
FRAMES_PER_MARKER = 5
"""Number of images from which a marker is placed, as in perception."""
FRAME_RATE = 30.0
"""Frame rate at which the share of a core is stated [Hz]."""
WARM_UP_FRAMES = 3
"""Number of frames that are not timed, because kernels are compiled."""


def run(
    frames: int = 200,
    places: int = 24,
    side: float = 0.04,
    seed: int = 0,
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Time the simulated camera and measure the accuracy of markers in its images.

    There is no plant: a curve of 40 nodes stands in place of the rope.

    Args:
        frames: Number of timed frames at each resolution.
        places: Number of random marker poses.
        side: Side of the marker's black square [m].
        seed: Seed of poses and noise.
    """
    rows = [measure(resolution, frames, places, side, seed) for resolution in RESOLUTIONS]
    conditions = (
        f"scene: curve of {NODE_COUNT} nodes, three cylinders, two grippers, table; "
        f"markers: {1e3 * side:g} mm, seen by the simulated camera, largest of {places} errors"
    )
    options.publish(Result("rows", rows, conditions))
    return 0


def measure(
    size: tuple[int, int], frames: int, places: int, side: float, seed: int
) -> dict[str, Any]:
    """Return cost and accuracy at one resolution."""
    random = np.random.default_rng(seed)
    view = Camera(
        Intrinsics.symmetric(*size, FIELD_OF_VIEW), looking_at(CAMERA_POSITION, CAMERA_TARGET)
    )
    camera = RgbdCamera(view, seed=seed)
    s = np.linspace(-1.0, 1.0, NODE_COUNT)
    rope = np.stack([0.2 * s, 0.0 * s - 0.1, 0.2 + 0.1 * s**2], axis=1)
    bodies = [
        TABLE,
        *(Obstacle("cylinder", (x, 0.0, 0.08), radius=0.03, height=0.16) for x in (-0.12, 0, 0.12)),
        *gripper_capsules(Pose(rope[0], LEVEL_GRIP), Pose(rope[-1], LEVEL_GRIP), *GRIPPER_SIZE),
    ]
    times = []
    for frame in range(frames + WARM_UP_FRAMES):
        started = time.process_time()
        camera.take(rope, ROPE_RADIUS, bodies, frame=frame)
        times.append(1e3 * (time.process_time() - started))
    times = times[WARM_UP_FRAMES:]
    position_errors, yaw_errors, missed = _marker_errors(camera, random, places, side)
    return {
        "resolution": f"{size[0]}x{size[1]}",
        "frame_ms_p50": float(np.median(times)),
        "frame_ms_p99": float(np.percentile(times, 99)),
        "core_share_at_30_Hz": FRAME_RATE * float(np.mean(times)) / 1e3,
        "marker_error_mm": 1e3 * max(position_errors, default=math.nan),
        "marker_error_deg": math.degrees(max(yaw_errors, default=math.nan)),
        "markers_missed": missed,
    }


def _marker_errors(
    camera: RgbdCamera, random: np.random.Generator, places: int, side: float
) -> tuple[list[float], list[float], int]:
    """Errors in position [m] and yaw [rad], and the number of markers that were never found."""
    detector = MarkerDetector()
    rope = np.array([[0.0, 0.0, -5.0], [0.1, 0.0, -5.0]])
    position_errors, yaw_errors, missed = [], [], 0
    for k in range(places):
        place = random.uniform([-0.25, -0.2, 0.02], [0.25, 0.2, 0.2])
        yaw = random.uniform(-math.pi, math.pi)
        pose = Pose(place, poses.exponential(np.array([0.0, 0.0, yaw])))
        stand = Obstacle("box", (*place[:2], place[2] / 2.0), size=(0.1, 0.1, place[2] - 1e-3))
        plate = MarkerPlate(pose, side, k % 50)
        pose_filter, filtered = MarkerPoseFilter(), None
        for image in range(FRAMES_PER_MARKER):
            shot = camera.take(
                rope,
                ROPE_RADIUS,
                (TABLE, stand),
                frame=FRAMES_PER_MARKER * k + image,
                plates=[plate],
            )
            for sighting in detector.detect(shot.color):
                seen = locate_marker(sighting, camera.camera, float(place[2]))
                if sighting.identity == k % 50 and seen is not None:
                    filtered = pose_filter.add(seen)
        if filtered is None:
            missed += 1
            continue
        position_errors.append(float(np.linalg.norm(filtered.position - place)))
        yaw_errors.append(abs(math.remainder(filtered.yaw - yaw, 2.0 * math.pi)))
    return position_errors, yaw_errors, missed
