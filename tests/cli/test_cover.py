"""A mesh, or what a depth image shows, becomes obstacles of a scenario."""

from __future__ import annotations

import io
import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from cli.__main__ import main
from lariat.geometry import poses
from lariat.geometry.cameras import Camera, Intrinsics, looking_at
from lariat.geometry.obstacles import scene_distance
from lariat.scenario import load
from tests.lariat.files.test_image_header import png_header
from tests.lariat.geometry.depth_scene import depths, image_of
from tests.lariat.geometry.meshes import prism_mesh

ANGLE = [(0.0, 0.0), (60.0, 0.0), (60.0, 10.0), (10.0, 10.0), (10.0, 50.0), (0.0, 50.0)]
"""Outline of an angle bracket [mm]."""
PLACE = ["--position", "0.1", "-0.4", "0.03", "--orientation", "0.8", "0", "0", "0.6"]
SCENARIO = """
name = "smallest"
[rope]
length = 0.45
diameter = 0.008
[start]
line = [[-0.2, 0.0, 0.3], [0.2, 0.0, 0.3]]
[goal]
line = [[-0.1, 0.1, 0.3], [0.25, 0.1, 0.3]]
"""


@pytest.fixture
def bracket(tmp_path: Path) -> Path:
    lines = [f"v {x} {y} {z}" for x, y, z in prism_mesh(ANGLE, 30.0).reshape(-1, 3)]
    lines += [f"f {k} {k + 1} {k + 2}" for k in range(1, len(lines), 3)]
    path = tmp_path / "bracket.obj"
    path.write_text("\n".join(lines))
    return path


def test_bodies_of_a_mesh_stand_in_the_scenario_where_the_mesh_stands(
    bracket: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cell = bracket.parent / "cell.toml"
    cell.write_text(SCENARIO)
    added = ["--scale", "0.001", *PLACE, "--output", str(cell)]
    assert main(["cover", str(bracket), *added]) == 0
    assert "2 bodies" in capsys.readouterr().err
    bodies = load(cell).bodies[1:]
    assert [body.name for body in bodies] == ["bracket-1", "bracket-2"]
    triangles = 1e-3 * prism_mesh(ANGLE, 30.0)
    turn = np.array([0.8, 0.0, 0.0, 0.6])
    points = poses.rotate(turn, triangles.reshape(-1, 3)) + np.array([0.1, -0.4, 0.03])
    distance = scene_distance(points, bodies)
    assert np.max(distance) <= 0.0
    assert np.min(distance) > -1e-4


def test_bodies_that_stick_out_too_far_are_said_to(
    bracket: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    single = ["--scale", "0.001", "--most", "1", "--json"]
    assert main(["cover", str(bracket), *single]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert len(answer["obstacles"]) == 1
    # The corner of the box is as far from the arms of the bracket as the nearer one is long.
    assert answer["overreach_mm"] == pytest.approx(40.0, abs=3.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "--scale 0.001"),
        (["--scale", "0.001", "--output", "missing.toml"], "missing.toml"),
        (["--scale", "0.001", "--most", "0"], "--most 0"),
        (["--scale", "0.001", "--orientation", "0", "0", "0", "0"], "no unit quaternion"),
    ],
)
def test_bad_input_is_refused_in_one_line(
    bracket: Path, options: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["cover", str(bracket), *options]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert len(error.splitlines()) == 1


def test_a_depth_image_becomes_bodies_that_contain_what_it_shows(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    eye, target = (0.1, -0.35, 0.9), (0.0, 0.0, 0.0)
    camera = Camera(Intrinsics.symmetric(160, 120, np.deg2rad(60.0)), looking_at(eye, target))
    picture = tmp_path / "depth.png"
    cv2.imwrite(str(picture), np.round(1e3 * image_of(camera)).astype(np.uint16))
    view = ["--position", *map(str, eye), "--look-at", *map(str, target), "--field-of-view", "60"]
    options = [*view, "--floor", "0.01", "--most", "6", "--tolerance", "200", "--json"]
    assert main(["cover", str(picture), *options]) == 0
    answer = json.loads(capsys.readouterr().out)
    cell = tmp_path / "cell.toml"
    cell.write_text(SCENARIO)
    assert main(["cover", str(picture), *options[:-1], "--output", str(cell)]) == 0
    bodies = load(cell).bodies[1:]
    assert [b.name for b in bodies] == [o["name"] for o in answer["obstacles"]]
    pixels = np.random.default_rng(3).uniform([0.0, 0.0], [159.0, 119.0], (5000, 2))
    points = camera.back_project(pixels, depths(pixels, camera))
    points = points[points[:, 2] > 0.0105]
    assert len(points) > 200
    assert np.max(scene_distance(points, bodies)) < 1e-4
    np.save(tmp_path / "depth.npy", image_of(camera))
    assert main(["cover", str(tmp_path / "depth.npy"), *options]) == 0
    again = json.loads(capsys.readouterr().out)
    assert again["overreach_mm"] == pytest.approx(answer["overreach_mm"], abs=5.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "needs either --field-of-view DEG or --intrinsics"),
        (["--field-of-view", "200"], "not within 1 to 170"),
        (["--field-of-view", "60", "--depth-range", "1", "0.5"], "the nearer one first"),
        (["--field-of-view", "60", "--depth-range", "0.1", "0.2"], "no pixel shows a surface"),
        (["--field-of-view", "60", "--look-at", "0", "0", "0"], "is where the camera is"),
    ],
)
def test_a_depth_image_without_what_it_needs_is_refused(
    tmp_path: Path, options: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "depth.npy"
    np.save(path, np.ones((12, 16)))
    assert main(["cover", str(path), *options]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert len(error.splitlines()) == 1


def claimed_array(rows: int) -> bytes:
    """Header of an NPY file, and nothing behind it."""
    file = io.BytesIO()
    description = {"descr": "<f8", "fortran_order": False, "shape": (rows, 8)}
    np.lib.format.write_array_header_1_0(file, description)
    return file.getvalue()


def saved(array: np.ndarray) -> bytes:
    """Content of an NPY file."""
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("depth.npy", saved(np.ones((3, 4, 2))), "rows and columns"),
        ("depth.npy", saved(np.array([["a"]])), "no array of numbers"),
        ("depth.npy", saved(np.ones((3, 4)))[:-8], "is damaged"),
        ("depth.npy", claimed_array(2**40), "more than 128 MiB"),
        ("depth.png", png_header(30000, 30000), "30000 x 30000 pixels"),
        ("depth.png", cv2.imencode(".png", np.ones((3, 4, 3), np.uint16))[1].tobytes(), "(3,)"),
        ("depth.png", cv2.imencode(".jpg", np.ones((8, 8), np.uint8))[1].tobytes(), "no PNG"),
    ],
    ids=["layers", "text", "torn", "huge-npy", "huge-png", "colours", "jpeg"],
)
def test_a_file_that_is_no_depth_image_is_refused(
    tmp_path: Path, name: str, content: bytes, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    assert main(["cover", str(path), "--field-of-view", "60"]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert len(error.splitlines()) == 1
