"""A camera that stands elsewhere than written is found by a marker on the arm."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cli.__main__ import main
from lariat.geometry import poses
from lariat.geometry.cameras import Camera
from lariat.geometry.poses import Pose
from lariat.perception.extrinsics import MarkerView, estimate_extrinsics
from lariat.scenario import parse
from lariat.simulation.camera.true_camera import true_camera
from stack.simulation.recorder_tap import RecorderTap
from tests.services.perception.cell import TEXT, Cell

WRONG = """
[plant]
model = "mujoco"
camera_shift = [0.012, -0.008, 0.015]
camera_turn = [0.8, -0.6, 1.0]
"""
MARKER = """
[sensing.flange_marker]
marker = 11
size = 0.04
"""


def carried(time: float) -> tuple[np.ndarray, np.ndarray]:
    """A slow loop in space."""
    size = np.array([0.06, 0.08, 0.05])
    rate = np.array([2.0, 3.0, 2.5])
    return size * np.sin(rate * time) * 0.9, 0.9 * size * rate * np.cos(rate * time)


TWO_CAMERAS = """
[cameras.above]
position = [0.0, -0.1, 1.0]
look_at = [0.0, 0.0, 0.2]
[cameras.beside]
position = [0.25, -0.2, 0.9]
look_at = [0.0, 0.0, 0.2]
"""


def record(path: Path, cameras: str = "", duration: float = 3.0) -> None:
    """Record a run in which an arm carries the marker through the view."""
    of = parse(TEXT.replace('[plant]\nmodel = "mujoco"\n', WRONG) + MARKER + cameras, Path())
    cell = Cell(of, carried)
    tap = RecorderTap(path, of, cell.stack)
    cell.stack.taps.append(tap)
    cell.run(duration)
    tap.close()


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("calibration") / "run.mcap"
    record(path, duration=1.6)
    return path


def test_the_camera_is_found_to_a_millimetre_and_a_tenth_of_a_degree(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    of = parse(TEXT.replace('[plant]\nmodel = "mujoco"\n', WRONG) + MARKER, Path())
    true = true_camera(of.camera_setups[0], of.plant).T_world_camera
    assert main(["calibrate", str(recorded), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["moved_mm"] > 15.0
    # What matters is what the camera then says of the table's middle.
    found = replace(of, sensing=_with(of.sensing, answer)).camera_setups[0].T_world_camera
    middle = np.array([0.0, 0.0, 0.2])
    seen = true.apply(found.inverse().apply(middle))
    assert np.linalg.norm(seen - middle) < 1.5e-3
    turn = poses.logarithm(poses.multiply(found.orientation, poses.conjugate(true.orientation)))
    assert np.linalg.norm(turn) < math.radians(0.2)
    assert answer["residual_px"] < 0.3
    assert max(answer["position_sd_mm"]) < 3.0


def _with(sensing, answer):
    return replace(
        sensing, position=tuple(answer["position"]), orientation=tuple(answer["orientation"])
    )


def test_the_deviations_are_those_of_repeated_calibrations() -> None:
    of = parse(TEXT, Path())
    camera = true_camera(of.camera_setups[0], of.plant)
    random = np.random.default_rng(3)
    square = 0.02 * np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]], float)
    places = random.uniform((-0.2, -0.2, 0.1), (0.2, 0.2, 0.4), (12, 3))
    found, deviations = [], []
    for _ in range(25):
        views = []
        for place in places:
            corners = place + square
            # A sighting errs as a whole.
            shift = random.normal(0.0, 0.2, 2)
            views.append(MarkerView(corners, camera.project(corners)[0] + shift))
        guess = Pose(camera.T_world_camera.position + 0.02, camera.T_world_camera.orientation)
        result = estimate_extrinsics(views, camera.intrinsics, guess)
        found.append(result.T_world_camera.position - camera.T_world_camera.position)
        deviations.append(result.position_deviation)
    ratio = np.std(found, axis=0) / np.mean(deviations, axis=0)
    assert np.all((ratio > 0.6) & (ratio < 1.6)), ratio


def test_one_wild_sighting_does_not_matter() -> None:
    of = parse(TEXT, Path())
    camera: Camera = true_camera(of.camera_setups[0], of.plant)
    square = 0.02 * np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]], float)
    places = np.random.default_rng(0).uniform((-0.2, -0.2, 0.1), (0.2, 0.2, 0.4), (12, 3))
    views = [MarkerView(p + square, camera.project(p + square)[0]) for p in places]
    views[3] = replace(views[3], pixels=views[3].pixels + 30.0)
    result = estimate_extrinsics(views, camera.intrinsics, camera.T_world_camera)
    gap = result.T_world_camera.position - camera.T_world_camera.position
    assert np.linalg.norm(gap) < 3e-3
    assert result.worst > 30.0


def test_a_recording_without_a_marker_is_refused(tmp_path: Path, capsys) -> None:
    of = parse(TEXT, Path())
    cell = Cell(of)
    tap = RecorderTap(tmp_path / "x.mcap", of, cell.stack)
    cell.stack.taps.append(tap)
    cell.run(0.2)
    tap.close()
    assert main(["calibrate", str(tmp_path / "x.mcap")]) == 2
    assert "flange_marker" in capsys.readouterr().err


def test_one_of_several_cameras_is_found_by_its_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "run.mcap"
    record(path, TWO_CAMERAS, duration=1.6)
    assert main(["calibrate", str(path)]) == 2
    assert "--camera, one of: above, beside" in capsys.readouterr().err
    assert main(["calibrate", str(path), "--camera", "beside", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    true = [0.262, -0.208, 0.915]  # with the shift of the plant
    np.testing.assert_allclose(answer["position"], true, atol=3e-3)
