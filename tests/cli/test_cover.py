"""A mesh becomes obstacles of a scenario."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from cli.__main__ import main
from lariat.geometry import poses
from lariat.geometry.obstacles import scene_distance
from shared.scenario import load
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
