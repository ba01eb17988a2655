"""`lariat calibrate FILE`: where the camera stands, from an arm that carried a marker about.

Any run will do in which the marker of `sensing.flange_marker` is carried about in the camera's
view; a slow one is better, and turns of the grip make it complete.
"""

from __future__ import annotations

import json as jsons
import tempfile
from bisect import bisect_left
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import tyro
from jaxtyping import Float64
from rich.console import Console
from rich.progress import track
from rich.table import Table

from cli.extrinsics import Extrinsics, View, solve
from lariat.geometry import poses
from lariat.geometry.cameras import Intrinsics
from lariat.geometry.poses import Pose
from services.perception.markers.marker_detection import MarkerDetector
from shared import topics
from shared.configuration import ConfigurationError
from shared.messages import arm_pose, poses_known, stamp_of
from shared.recording import Recording
from shared.scenario import Scenario

COLOR = topics.CAMERA_COLOR.at(topics.CAMERA).key
CALIBRATION = topics.CAMERA_CALIBRATION.at(topics.CAMERA).key
APART = 0.01
"""Two sightings nearer to each other tell the same [m]."""
FEWEST = 6
"""Places at which the marker must be seen."""
SPREAD = 0.03
"""Least standard deviation of those places along the widest direction [m]."""
QUICK = 0.25
"""A marker that moves faster is smeared, and its stamp too coarse [m/s]."""


@dataclass(frozen=True)
class Sightings:
    """What a recording tells."""

    views: list[View]
    intrinsics: Intrinsics


def main(file: tyro.conf.Positional[Path], /, json: bool = False) -> int:
    """Find out where the camera stands from a recording of an arm that carries a marker.

    The recording's scenario names the marker in sensing.flange_marker. The answer are the lines
    for the scenario's [sensing], with the residuals.

    Examples:
      lariat calibrate recordings/run.mcap

    Args:
        file: The MCAP file.
        json: Answer with one JSON object on standard output.
    """
    with tempfile.TemporaryDirectory() as folder:
        try:
            recording = Recording.open(file)
            scenario = recording.scenario(Path(folder))
        except ValueError as error:
            raise ConfigurationError(f"{file}: {error}") from error
        found = sightings(recording, scenario)
        result = solve(found.views, found.intrinsics, scenario.camera_pose)
        answer = _answer(result, scenario.camera_pose, len(found.views))
    if json:
        print(jsons.dumps(answer))
        return 0
    table = Table(title=f"{file.name}: {len(found.views)} places", title_justify="left")
    for heading in ("", ""):
        table.add_column(heading)
    table.add_row("residual", f"{answer['residual_px']} px ({answer['residual_mm']} mm)")
    table.add_row("worst corner", f"{answer['worst_px']} px")
    table.add_row("moved by", f"{answer['moved_mm']} mm, {answer['turned_deg']}°")
    table.add_row("deviation", f"{answer['position_sd_mm']} mm, {answer['rotation_sd_deg']}°")
    console = Console(highlight=False)
    console.print(table)
    console.print(
        f"position = {answer['position']}\norientation = {answer['orientation']}", markup=False
    )
    return 0


def sightings(recording: Recording, scenario: Scenario) -> Sightings:
    """The places at which the marker was seen.

    Raises:
        ConfigurationError: The scenario names no marker, or it was seen too seldom.
    """
    marker = scenario.sensing.flange_marker
    if marker is None:
        raise ConfigurationError(
            "the recording's scenario has no sensing.flange_marker; add [sensing.flange_marker] "
            "with marker, side, size, position and orientation, and record again"
        )
    half = marker.size / 2.0
    square = half * np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]], float)
    stamps, grips, speeds = _way(recording, marker.side)
    detector, intrinsics = MarkerDetector(), None
    views: list[View] = []
    console = Console(stderr=True)
    for entry in track(
        recording.messages((COLOR, CALIBRATION)), "Looking", console=console, transient=True
    ):
        message = entry.parse()
        if entry.key == CALIBRATION:
            intrinsics = _intrinsics(message)
            continue
        at = _between(stamps, grips, speeds, stamp_of(message))
        if at is None:
            continue
        corners = marker.at(at).apply(square)
        if any(np.linalg.norm(v.corners.mean(0) - corners.mean(0)) < APART for v in views):
            continue
        image = cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_COLOR)
        if image is None:
            continue
        seen = [s for s in detector.detect(image[..., ::-1].copy()) if s.identity == marker.marker]
        views += [View(corners, s.corners) for s in seen[:1]]
    if intrinsics is None:
        raise ConfigurationError(f"the recording holds nothing on {CALIBRATION}")
    places = np.array([v.corners.mean(axis=0) for v in views]).reshape(-1, 3)
    spread = float(np.max(np.std(places, axis=0))) if len(places) else 0.0
    if len(views) < FEWEST or spread < SPREAD:
        raise ConfigurationError(
            f"marker {marker.marker} was seen at {len(views)} places that spread by "
            f"{1e3 * spread:.0f} mm; carry it slowly to at least {FEWEST} places, "
            f"{1e3 * SPREAD:.0f} mm or more apart on average"
        )
    return Sightings(views, intrinsics)


def _way(recording: Recording, side: str) -> tuple[list[int], list[Pose], list[float]]:
    """Stamps, poses and speeds of a grip."""
    stamps: list[int] = []
    grips: list[Pose] = []
    speeds: list[float] = []
    for entry in recording.messages((topics.ARM_STATE.key,)):
        states = entry.parse()
        if poses_known(states):
            stamps.append(states.stamp)
            grips.append(arm_pose(states, side))
            velocity = next(a.linear_velocity for a in states.arms if a.arm == side)
            speeds.append(float(np.linalg.norm(velocity)))
    return stamps, grips, speeds


def _between(stamps: list[int], grips: list[Pose], speeds: list[float], stamp: int) -> Pose | None:
    """Where the grip was, unless nobody knows or it was too quick."""
    k = bisect_left(stamps, stamp)
    if k == 0 or k == len(stamps) or speeds[k] > QUICK:
        return None
    part = (stamp - stamps[k - 1]) / (stamps[k] - stamps[k - 1])
    a, b = grips[k - 1], grips[k]
    return Pose(
        (1.0 - part) * a.position + part * b.position,
        poses.slerp(a.orientation, b.orientation, part),
    )


def _intrinsics(message: Any) -> Intrinsics:
    k = message.K
    return Intrinsics(message.width, message.height, k[0], k[4], k[2], k[5])


def _answer(result: Extrinsics, before: Pose, places: int) -> dict[str, Any]:
    pose = result.T_world_camera
    turn = poses.logarithm(poses.multiply(pose.orientation, poses.conjugate(before.orientation)))
    return {
        "places": places,
        "residual_px": round(result.residual, 3),
        "residual_mm": round(1e3 * result.residual_length, 3),
        "worst_px": round(result.worst, 3),
        "moved_mm": round(1e3 * float(np.linalg.norm(pose.position - before.position)), 2),
        "turned_deg": round(float(np.degrees(np.linalg.norm(turn))), 3),
        "position_sd_mm": _rounded(1e3 * result.position_deviation, 2),
        "rotation_sd_deg": _rounded(np.degrees(result.rotation_deviation), 3),
        "position": _rounded(pose.position, 5),
        "orientation": _rounded(pose.orientation, 6),
    }


def _rounded(values: Float64[np.ndarray, "k"], digits: int) -> list[float]:
    return [round(float(v), digits) for v in values]
