"""What the simulated camera costs, and how well markers are placed in it: `lariat bench camera`.

A hanging rope, three cylinders with markers on top, two grippers and the table, as in
`scenarios/markers.toml`. Costs are processor time of one frame with all of its noise, and what that
is of a core at 30 frames a second; messages are left out.
"""

from __future__ import annotations

import json as encoder
import math
import time
from dataclasses import dataclass

import numpy as np
from rich.console import Console
from rich.table import Table

from lariat.geometry import poses
from lariat.geometry.cameras import Camera, Intrinsics, looking_at
from lariat.geometry.obstacles import TABLE, Obstacle
from lariat.geometry.poses import Pose
from services.perception.markers.marker_detection import MarkerDetector
from services.perception.markers.marker_pose import MarkerPoseFilter, locate_marker
from services.sim.camera.marker_plates import MarkerPlate
from services.sim.camera.rgbd_camera import RgbdCamera
from services.sim.gripper_body import gripper_body

SIZES = ((640, 480), (1280, 720))
VIEW = math.radians(65.0)
EYE = (0.0, -0.05, 1.0)
LOOKS = 5
"""At a marker before its place is taken, as perception does."""
RATE = 30.0
"""Frames a second."""
WARM = 3
"""Frames that compile."""


@dataclass(frozen=True)
class Row:
    """One size of images."""

    resolution: str
    frame_ms_p50: float
    frame_ms_p99: float
    share_of_a_core: float
    """At 30 Hz."""
    marker_mm: float
    """Largest error of a marker's place in its plane."""
    marker_degrees: float
    """Largest error of its yaw."""
    markers_missed: int


def run(
    frames: int = 200, places: int = 24, side: float = 0.04, seed: int = 0, json: bool = False
) -> int:
    """Prints the table.

    Args:
        frames: That are timed, of each size.
        places: Random places of a marker.
        side: Of the marker's black square [m].
        seed: Of the places.
        json: One JSON object on standard output instead of a table.
    """
    rows = [measured(size, frames, places, side, seed) for size in SIZES]
    if json:
        print(encoder.dumps({"frames": frames, "marker_m": side, "rows": [vars(r) for r in rows]}))
        return 0
    table = Table(*(name.replace("_", " ") for name in vars(rows[0])))
    for row in rows:
        table.add_row(*(f"{v:.3g}" if isinstance(v, float) else str(v) for v in vars(row).values()))
    Console().print(table)
    return 0


def measured(size: tuple[int, int], frames: int, places: int, side: float, seed: int) -> Row:
    """One line of the table."""
    random = np.random.default_rng(seed)
    view = Camera(Intrinsics.symmetric(*size, VIEW), looking_at(EYE, (0.0, 0.0, 0.1)))
    camera = RgbdCamera(view, seed=seed)
    s = np.linspace(-1.0, 1.0, 40)
    rope = np.stack([0.2 * s, 0.0 * s - 0.1, 0.2 + 0.1 * s**2], axis=1)
    level = np.array([0.5, 0.5, 0.5, 0.5])
    bodies = [
        TABLE,
        *(Obstacle("cylinder", (x, 0.0, 0.08), radius=0.03, height=0.16) for x in (-0.12, 0, 0.12)),
        gripper_body(Pose(rope[0], level), -1.0, 0.012, 0.06),
        gripper_body(Pose(rope[-1], level), 1.0, 0.012, 0.06),
    ]
    times = []
    for frame in range(frames + WARM):
        began = time.process_time()
        camera.take(rope, 0.004, bodies, frame=frame)
        times.append(1e3 * (time.process_time() - began))
    times = times[WARM:]
    gaps, turns, missed = _markers(camera, random, places, side)
    return Row(
        f"{size[0]}x{size[1]}",
        float(np.median(times)),
        float(np.percentile(times, 99)),
        RATE * float(np.mean(times)) / 1e3,
        1e3 * max(gaps, default=math.nan),
        math.degrees(max(turns, default=math.nan)),
        missed,
    )


def _markers(
    camera: RgbdCamera, random: np.random.Generator, places: int, side: float
) -> tuple[list[float], list[float], int]:
    """Errors in place [m] and yaw [rad] after `LOOKS` looks, and how many were never seen."""
    detector = MarkerDetector()
    away = np.array([[0.0, 0.0, -5.0], [0.1, 0.0, -5.0]])
    gaps, turns, missed = [], [], 0
    for k in range(places):
        place = random.uniform([-0.25, -0.2, 0.02], [0.25, 0.2, 0.2])
        yaw = random.uniform(-math.pi, math.pi)
        pose = Pose(place, poses.exponential(np.array([0.0, 0.0, yaw])))
        stand = Obstacle("box", (*place[:2], place[2] / 2.0), size=(0.1, 0.1, place[2] - 1e-3))
        plate = MarkerPlate(pose, side, k % 50)
        steady, found = MarkerPoseFilter(), None
        for look in range(LOOKS):
            shot = camera.take(away, 0.004, (TABLE, stand), frame=LOOKS * k + look, plates=[plate])
            for sighting in detector.detect(shot.color):
                seen = locate_marker(sighting, camera.camera, float(place[2]))
                if sighting.identity == k % 50 and seen is not None:
                    found = steady.add(seen)
        if found is None:
            missed += 1
            continue
        gaps.append(float(np.linalg.norm(found.position - place)))
        turns.append(abs(math.remainder(found.yaw - yaw, 2.0 * math.pi)))
    return gaps, turns, missed
