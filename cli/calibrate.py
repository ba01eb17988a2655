"""`lariat calibrate FILE`: pose of the camera from a recording of an arm that carries a marker.

Any run in which the marker of `sensing.flange_marker` moves through the camera's view will do. Slow
motion gives better results; rotations of the grip make the calibration complete.
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
from rich.progress import track
from rich.table import Table

from cli.terminal import Terminal
from lariat.configuration import ConfigurationError, refusing
from lariat.geometry import poses
from lariat.geometry.cameras import Intrinsics
from lariat.geometry.poses import Pose
from lariat.perception.extrinsics import Extrinsics, MarkerView, estimate_extrinsics
from lariat.perception.markers.marker_detection import MarkerDetector
from lariat.scenario import Scenario
from lariat.scenario.cameras import CameraSetup
from shared import topics
from shared.camera_messages import intrinsics_of
from shared.messages import arm_pose, poses_known, stamp_of
from shared.recording import Recording

MIN_VIEW_DISTANCE = 0.01
"""Distance between two places of the marker below which the second adds nothing [m]."""
MIN_VIEWS = 6
"""Number of places at which the marker must be seen."""
MIN_SPREAD = 0.03
"""Least standard deviation of those places along their widest axis [m]."""
MAX_SPEED = 0.25
"""Speed of the grip above which the image is blurred and its stamp too coarse [m/s]."""


@dataclass(frozen=True)
class CalibrationData:
    """Views of the marker in a recording."""

    views: list[MarkerView]
    """Marker at each place."""
    intrinsics: Intrinsics
    """Intrinsics of the camera."""


def main(file: tyro.conf.Positional[Path], /, camera: str = "", json: bool = False) -> int:
    """Calibrate the camera's pose from a recording of an arm that carries a marker.

    The recording's scenario describes the marker in sensing.flange_marker. Prints position and
    orientation for the camera's section of the scenario, with residuals and standard deviations.

    Examples:
      lariat calibrate recordings/run.mcap

    Args:
        file: MCAP recording.
        camera: Name of the camera, if the cell has several.
        json: Print one JSON object on standard output instead of a table.
    """
    with tempfile.TemporaryDirectory() as folder:
        with refusing(f"cannot calibrate by {file}"):
            recording = Recording.open(file)
            scenario = recording.scenario(Path(folder))
        setup = _camera(scenario, camera)
        recorded = read_views(recording, scenario, setup.name)
        result = estimate_extrinsics(recorded.views, recorded.intrinsics, setup.T_world_camera)
        answer = _answer(result, setup.T_world_camera, len(recorded.views))
    if json:
        print(jsons.dumps(answer))
        return 0
    table = Table(title=f"{file.name}: {len(recorded.views)} places", title_justify="left")
    for heading in ("", ""):
        table.add_column(heading)
    table.add_row("residual", f"{answer['residual_px']} px ({answer['residual_mm']} mm)")
    table.add_row("worst corner", f"{answer['worst_px']} px")
    table.add_row("correction", f"{answer['moved_mm']} mm, {answer['turned_deg']}°")
    table.add_row(
        "standard deviation", f"{answer['position_sd_mm']} mm, {answer['rotation_sd_deg']}°"
    )
    console = Terminal()
    console.print(table)
    console.print(f"position = {answer['position']}\norientation = {answer['orientation']}")
    return 0


def _camera(scenario: Scenario, name: str) -> CameraSetup:
    setups = {setup.name: setup for setup in scenario.camera_setups}
    if not name and len(setups) == 1:
        return next(iter(setups.values()))
    if name not in setups:
        names = ", ".join(setups)
        fault = f"there is no camera {name!r}" if name else "there are several cameras"
        raise ConfigurationError(f"{fault}; give --camera, one of: {names}")
    return setups[name]


def read_views(recording: Recording, scenario: Scenario, camera: str) -> CalibrationData:
    """Return the views of the marker that a camera took in a recording."""
    marker = scenario.sensing.flange_marker
    if marker is None:
        raise ConfigurationError(
            "the recording's scenario has no [sensing.flange_marker]; add it with marker, side, "
            "size, position and orientation, and record again"
        )
    half = marker.size / 2.0
    square = half * np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]], float)
    stamps, grips, speeds = _grip_track(recording, marker.side)
    detector, intrinsics = MarkerDetector(), None
    color_key = topics.CAMERA_COLOR.at(camera).key
    calibration_key = topics.CAMERA_CALIBRATION.at(camera).key
    views: list[MarkerView] = []
    console = Terminal(stderr=True)
    for entry, message in track(
        recording.decoded((color_key, calibration_key)),
        "Detecting markers",
        console=console,
        transient=True,
    ):
        if entry.key == calibration_key:
            intrinsics = intrinsics_of(message)
            continue
        at = _grip_at(stamps, grips, speeds, stamp_of(message))
        if at is None:
            continue
        corners = marker.at(at).apply(square)
        if any(
            np.linalg.norm(v.corners.mean(0) - corners.mean(0)) < MIN_VIEW_DISTANCE for v in views
        ):
            continue
        image = cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_COLOR)
        if image is None:
            continue
        seen = [s for s in detector.detect(image[..., ::-1].copy()) if s.identity == marker.marker]
        views += [MarkerView(corners, s.corners) for s in seen[:1]]
    if intrinsics is None:
        raise ConfigurationError(
            f"the recording has no messages on {calibration_key}; record the camera's calibration"
        )
    places = np.array([v.corners.mean(axis=0) for v in views]).reshape(-1, 3)
    spread = float(np.max(np.std(places, axis=0))) if len(places) else 0.0
    if len(views) < MIN_VIEWS or spread < MIN_SPREAD:
        raise ConfigurationError(
            f"marker {marker.marker} was seen at {len(views)} places that spread by "
            f"{1e3 * spread:.0f} mm; carry it slowly to at least {MIN_VIEWS} places, "
            f"{1e3 * MIN_SPREAD:.0f} mm or more apart on average"
        )
    return CalibrationData(views, intrinsics)


def _grip_track(recording: Recording, side: str) -> tuple[list[int], list[Pose], list[float]]:
    """Stamps [ns], poses and speeds [m/s] of a grip."""
    stamps: list[int] = []
    grips: list[Pose] = []
    speeds: list[float] = []
    for _, states in recording.decoded((topics.ARM_STATE.key,)):
        if poses_known(states):
            stamps.append(states.stamp)
            grips.append(arm_pose(states, side))
            velocity = next(a.linear_velocity for a in states.arms if a.arm == side)
            speeds.append(float(np.linalg.norm(velocity)))
    return stamps, grips, speeds


def _grip_at(stamps: list[int], grips: list[Pose], speeds: list[float], stamp: int) -> Pose | None:
    """Pose of the grip at a stamp; None where it is unknown or moved too fast."""
    k = bisect_left(stamps, stamp)
    if k == 0 or k == len(stamps) or speeds[k] > MAX_SPEED:
        return None
    share = (stamp - stamps[k - 1]) / (stamps[k] - stamps[k - 1])
    return poses.interpolate(grips[k - 1], grips[k], share)


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
